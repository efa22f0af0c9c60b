// The scalars of the precision ladder besides double, and what mechanism and formulations are
// compiled for a second time (mechanism/instantiate.h): the plane in each of them, and space in
// long double for tests.
#pragma once

#include <boost/multiprecision/eigen.hpp>
#include <boost/multiprecision/float128.hpp>
#include <numbers>

namespace loopbench {

/// IEEE binary128 in software (libquadmath): 113 bits, eps 1.9e-34.
using Float128 = boost::multiprecision::float128;

}  // namespace loopbench

template <>
inline const loopbench::Float128 std::numbers::pi_v<loopbench::Float128> =
    acos(loopbench::Float128(-1));

#define LOOPBENCH_FOR_EACH_SCALAR(MACRO) \
  MACRO(float) MACRO(long double) MACRO(::loopbench::Float128)
#define LOOPBENCH_FOR_EACH_PLANAR_AND_SCALAR(MACRO) \
  MACRO(Planar, float) MACRO(Planar, long double) MACRO(Planar, ::loopbench::Float128)
#ifdef LOOPBENCH_SPATIAL_LONG_DOUBLE
#define LOOPBENCH_FOR_EACH_SPACE_AND_SCALAR(MACRO) \
  LOOPBENCH_FOR_EACH_PLANAR_AND_SCALAR(MACRO) MACRO(Spatial, long double)
#else
#define LOOPBENCH_FOR_EACH_SPACE_AND_SCALAR(MACRO) LOOPBENCH_FOR_EACH_PLANAR_AND_SCALAR(MACRO)
#endif
// the model's lists have no more scalars here
#define LOOPBENCH_FOR_EACH_MODEL_SCALAR(MACRO) LOOPBENCH_FOR_EACH_SCALAR(MACRO)
#define LOOPBENCH_FOR_EACH_SPACE_AND_MODEL_SCALAR(MACRO) LOOPBENCH_FOR_EACH_SPACE_AND_SCALAR(MACRO)
