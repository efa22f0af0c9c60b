// (space, scalar) pairs for which templates are compiled: double, unless the build defines other
// macros first (harness/precision/scalars.h). The mechanism model, which forms the equations of
// motion, is also compiled for dual numbers (forward_jacobian.h); solvers are not.
#pragma once

#ifndef LOOPBENCH_FOR_EACH_SCALAR
#include "mechanism/algebra/dual.h"

#define LOOPBENCH_FOR_EACH_SCALAR(MACRO) MACRO(double)
#define LOOPBENCH_FOR_EACH_SPACE_AND_SCALAR(MACRO) MACRO(Planar, double) MACRO(Spatial, double)
#define LOOPBENCH_FOR_EACH_MODEL_SCALAR(MACRO) LOOPBENCH_FOR_EACH_SCALAR(MACRO) MACRO(Dual)
#define LOOPBENCH_FOR_EACH_SPACE_AND_MODEL_SCALAR(MACRO) \
  LOOPBENCH_FOR_EACH_SPACE_AND_SCALAR(MACRO) MACRO(Planar, Dual) MACRO(Spatial, Dual)
#endif
