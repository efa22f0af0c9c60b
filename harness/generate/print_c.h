// A graph as C99: straight-line functions of some hundred operations each, which pass values on
// through an array. The time to compile a function grows faster than its length.
#pragma once

#include <string>

#include "harness/generate/record.h"

namespace loopbench::generate {

/// Names of what the text defines:
///
///   int loopbench_derivative(const double* x, double* y, double* w, loopbench_sines sines)
///   const int loopbench_room
///
/// x is time and state, y receives dy/dt, w has room for loopbench_room numbers, and `sines`
/// computes sine and cosine of the angle of a planar pose. Returns 0 if a comparison comes out
/// otherwise than it was recorded; y is unspecified then. The text depends on the graph alone.
std::string PrintC(const RecordedDerivative& recorded);

}  // namespace loopbench::generate
