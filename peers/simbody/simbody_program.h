// A model in Simbody 3.7 (https://simtk.org/projects/simbody). C++17: its headers do not compile
// as C++20.
#pragma once

#include <memory>

#include "harness/exchange/model.h"
#include "peers/program.h"

namespace loopbench::peers {

/// Makes the program: tree joints become mobilizers with the same coordinates and speeds, cut
/// joints and couplings become constraints, rotors become flywheels, forces become Simbody's own
/// elements. Throws Unsupported for a helical cut joint.
///
/// RungeKuttaMersonIntegrator runs with `accuracy` = tolerance (|W yerr|_RMS, its own weights) and
/// a tenth of it as constraint tolerance, Simbody's default. Positions, speeds and the error
/// estimate are projected if they violate it.
std::unique_ptr<Program> MakeSimbodyProgram(const exchange::Model& model);

}  // namespace loopbench::peers
