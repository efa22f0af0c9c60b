// IEEE binary128 in software: 113 bits, eps 1.9e-34. The compiler's __float128 and functions of
// libquadmath, with the traits that Eigen and the mechanism's templates need.
#pragma once

#include <quadmath.h>

#include <Eigen/Core>
#include <limits>
#include <numbers>
#include <type_traits>

namespace loopbench {

struct Float128 {
  __float128 value;

  Float128() = default;  // as indefinite as a double's
  constexpr Float128(__float128 number) : value(number) {}
  template <class Number>
  requires std::is_arithmetic_v<Number>
  constexpr Float128(Number number) : value(number) {}
  template <class Number>
  requires std::is_arithmetic_v<Number>
  constexpr explicit operator Number() const { return static_cast<Number>(value); }

  Float128& operator+=(Float128 b) { return value += b.value, *this; }
  Float128& operator-=(Float128 b) { return value -= b.value, *this; }
  Float128& operator*=(Float128 b) { return value *= b.value, *this; }
  Float128& operator/=(Float128 b) { return value /= b.value, *this; }

  friend Float128 operator+(Float128 a) { return a; }
  friend Float128 operator-(Float128 a) { return -a.value; }
  friend Float128 operator+(Float128 a, Float128 b) { return a.value + b.value; }
  friend Float128 operator-(Float128 a, Float128 b) { return a.value - b.value; }
  friend Float128 operator*(Float128 a, Float128 b) { return a.value * b.value; }
  friend Float128 operator/(Float128 a, Float128 b) { return a.value / b.value; }

  friend bool operator==(Float128 a, Float128 b) { return a.value == b.value; }
  friend bool operator<(Float128 a, Float128 b) { return a.value < b.value; }
  friend bool operator>(Float128 a, Float128 b) { return a.value > b.value; }
  friend bool operator<=(Float128 a, Float128 b) { return a.value <= b.value; }
  friend bool operator>=(Float128 a, Float128 b) { return a.value >= b.value; }

  friend Float128 abs(Float128 x) { return fabsq(x.value); }
  friend Float128 sqrt(Float128 x) { return sqrtq(x.value); }
  friend Float128 sin(Float128 x) { return sinq(x.value); }
  friend Float128 cos(Float128 x) { return cosq(x.value); }
  friend Float128 asin(Float128 x) { return asinq(x.value); }
  friend Float128 acos(Float128 x) { return acosq(x.value); }
  friend Float128 atan2(Float128 y, Float128 x) { return atan2q(y.value, x.value); }
  friend Float128 exp(Float128 x) { return expq(x.value); }
  friend Float128 expm1(Float128 x) { return expm1q(x.value); }
  friend Float128 log(Float128 x) { return logq(x.value); }
  friend Float128 pow(Float128 x, Float128 y) { return powq(x.value, y.value); }
  friend Float128 round(Float128 x) { return roundq(x.value); }
  friend Float128 remainder(Float128 x, Float128 y) { return remainderq(x.value, y.value); }
  friend bool isfinite(Float128 x) { return finiteq(x.value) != 0; }
  friend bool isinf(Float128 x) { return isinfq(x.value) != 0; }
  friend bool isnan(Float128 x) { return isnanq(x.value) != 0; }
};

}  // namespace loopbench

/// A long double has the same exponents, so that powers of two and infinity are exact.
template <>
class std::numeric_limits<loopbench::Float128> : public std::numeric_limits<long double> {
 public:
  static constexpr int digits = 113, digits10 = 33, max_digits10 = 36;
  static constexpr loopbench::Float128 epsilon() { return 0x1p-112; }
  static constexpr loopbench::Float128 min() { return 0x1p-16382L; }
  static constexpr loopbench::Float128 max() {
    return (2 - epsilon().value) * loopbench::Float128(0x1p16383L).value;
  }
  static constexpr loopbench::Float128 lowest() { return -max().value; }
  static constexpr loopbench::Float128 infinity() { return HUGE_VALL; }
  static constexpr loopbench::Float128 quiet_NaN() {
    return std::numeric_limits<double>::quiet_NaN();
  }
};

template <>
inline const loopbench::Float128 std::numbers::pi_v<loopbench::Float128> =
    acos(loopbench::Float128(-1));

namespace Eigen {
template <>
struct NumTraits<loopbench::Float128> : GenericNumTraits<loopbench::Float128> {
  using Literal = double;
  enum { RequireInitialization = 0, ReadCost = 1, AddCost = 4, MulCost = 8 };
  static loopbench::Float128 dummy_precision() { return 1000 * epsilon(); }
};
}  // namespace Eigen
