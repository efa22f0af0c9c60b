// Which (space, scalar) pairs the templates are compiled for: double, unless the build has put
// other macros before everything else (harness/precision/scalars.h). The mechanism model, all that
// the equations of motion are made of, is compiled for dual numbers as well (forward_jacobian.h);
// solvers are not.
#pragma once

#ifndef LOOPBENCH_FOR_EACH_SCALAR
#include "mechanism/algebra/dual.h"

#define LOOPBENCH_FOR_EACH_SCALAR(MACRO) MACRO(double)
#define LOOPBENCH_FOR_EACH_SPACE_AND_SCALAR(MACRO) MACRO(Planar, double) MACRO(Spatial, double)
#define LOOPBENCH_FOR_EACH_MODEL_SCALAR(MACRO) LOOPBENCH_FOR_EACH_SCALAR(MACRO) MACRO(Dual)
#define LOOPBENCH_FOR_EACH_SPACE_AND_MODEL_SCALAR(MACRO) \
  LOOPBENCH_FOR_EACH_SPACE_AND_SCALAR(MACRO) MACRO(Planar, Dual) MACRO(Spatial, Dual)
#endif
