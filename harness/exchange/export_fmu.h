// Generated code (export_c.h) as a Functional Mock-up Unit: FMI 2.0 for model exchange and for
// co-simulation, with sources and a binary for 64-bit Linux.
//
// Variables: the state, its derivatives, energies and poses. Co-simulation integrates by the
// classical Runge-Kutta method of order 4 and projects after each communication step.
#pragma once

#include <string>

#include "harness/exchange/export_c.h"

namespace loopbench::exchange {

/// Returns the bytes of the archive, which depend only on the code and the compiler.
/// @param step  maximum step of co-simulation [s]
/// Throws generate::NotCovered if there is no C compiler.
std::string MakeFmu(const Code& code, const std::string& model_name, double step);

}  // namespace loopbench::exchange
