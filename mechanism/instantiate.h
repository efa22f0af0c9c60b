// Which (space, scalar) pairs the templates are compiled for. long double serves tests and
// references and doubles the time of a build, so it is a choice of the build
// (LOOPBENCH_LONG_DOUBLE). The mechanism model, all that the equations of motion are made of, is
// compiled for dual numbers as well (forward_jacobian.h); solvers are not.
#pragma once

#include "mechanism/dual.h"

#ifdef LOOPBENCH_LONG_DOUBLE
#define LOOPBENCH_FOR_EACH_SCALAR(MACRO) MACRO(double) MACRO(long double)
#define LOOPBENCH_FOR_EACH_SPACE_AND_SCALAR(MACRO) \
  MACRO(Planar, double)                            \
  MACRO(Spatial, double) MACRO(Planar, long double) MACRO(Spatial, long double)
#else
#define LOOPBENCH_FOR_EACH_SCALAR(MACRO) MACRO(double)
#define LOOPBENCH_FOR_EACH_SPACE_AND_SCALAR(MACRO) MACRO(Planar, double) MACRO(Spatial, double)
#endif

#define LOOPBENCH_FOR_EACH_SPACE_AND_MODEL_SCALAR(MACRO) \
  LOOPBENCH_FOR_EACH_SPACE_AND_SCALAR(MACRO) MACRO(Planar, Dual) MACRO(Spatial, Dual)
