// Given functions of time, evaluated anew in long double: powers one by one, splines as cubics in
// powers of time whose coefficients solve one dense system.
#pragma once

#include "mechanism/description/time_function.h"
#include "tests/contract/jet.h"

namespace loopbench::testing {

/// Value and two derivatives at time t; at a knot, of the piece that begins there.
Jet OracleAt(const TimeFunctionDescription& function, Real t);

}  // namespace loopbench::testing
