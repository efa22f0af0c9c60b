// A model in Simbody 3.7 (https://simtk.org/projects/simbody). C++17: its headers do not compile
// as C++20.
#pragma once

#include <memory>

#include "harness/exchange/model.h"
#include "peers/program.h"

namespace loopbench::peers {

/// Tree joints are mobilizers with the same coordinates and speeds, joints that close loops are
/// constraints, forces are Simbody's own elements. Throws NotThere for a helical joint that closes
/// a loop.
///
/// Steps are those of RungeKuttaMersonIntegrator at `accuracy` = tolerance (|W yerr|_RMS, its own
/// weights) and a constraint tolerance of a tenth of it, which is Simbody's default: positions and
/// speeds are projected, and the error estimate too, where they miss it.
std::unique_ptr<Program> MakeSimbodyProgram(const exchange::Model& model);

}  // namespace loopbench::peers
