// The scalars of the precision study besides double. Mechanism and formulations are also compiled
// for them (mechanism/algebra/instantiate.h): the plane in each, space in long double only. Each
// unit of CMakeLists.txt names the scalar that it compiles.
#pragma once

#include "harness/precision/float128.h"

#ifdef LOOPBENCH_ONE_SCALAR
#define LOOPBENCH_FOR_EACH_SCALAR(MACRO) MACRO(LOOPBENCH_ONE_SCALAR)
#ifdef LOOPBENCH_IN_SPACE_TOO
#define LOOPBENCH_FOR_EACH_SPACE_AND_SCALAR(MACRO) \
  MACRO(Planar, LOOPBENCH_ONE_SCALAR) MACRO(Spatial, LOOPBENCH_ONE_SCALAR)
#else
#define LOOPBENCH_FOR_EACH_SPACE_AND_SCALAR(MACRO) MACRO(Planar, LOOPBENCH_ONE_SCALAR)
#endif
#else
#define LOOPBENCH_FOR_EACH_SCALAR(MACRO) \
  MACRO(float) MACRO(long double) MACRO(::loopbench::Float128)
#endif
// the model's lists have no more scalars here
#define LOOPBENCH_FOR_EACH_MODEL_SCALAR(MACRO) LOOPBENCH_FOR_EACH_SCALAR(MACRO)
#define LOOPBENCH_FOR_EACH_SPACE_AND_MODEL_SCALAR(MACRO) LOOPBENCH_FOR_EACH_SPACE_AND_SCALAR(MACRO)
