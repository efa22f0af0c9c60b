// Which (space, scalar) pairs the templates are compiled for: double, unless the build has put
// other macros before everything else (harness/precision/scalars.h).
#pragma once

#ifndef LOOPBENCH_FOR_EACH_SCALAR
#define LOOPBENCH_FOR_EACH_SCALAR(MACRO) MACRO(double)
#define LOOPBENCH_FOR_EACH_SPACE_AND_SCALAR(MACRO) MACRO(Planar, double) MACRO(Spatial, double)
#endif
