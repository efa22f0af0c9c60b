// Dual numbers: a value with its partial derivatives in N directions at once. A template that is
// evaluated with them computes its own derivatives to round-off (forward differentiation; A.
// Griewank, A. Walther, Evaluating Derivatives, 2008, ch. 3).
//
// Comparisons look at values alone, so that a program takes the same branches as with `double`; a
// derivative is then that of the branch. What has no derivative gets one that does no harm where it
// is multiplied by zero: that of sqrt(0) is zero.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cmath>
#include <compare>
#include <numbers>

namespace loopbench {

template <int N>
struct Dual {
  double value;
  std::array<double, N> partials;

  Dual() = default;  // as indefinite as a double's
  Dual(double constant) : value(constant), partials{} {}
  /// f(x) with df/dx, x a dual number.
  Dual(double f, double slope, const Dual& x) : value(f) {
    for (int i = 0; i < N; ++i) partials[i] = slope * x.partials[i];
  }
  /// f(x, y) with its two partial derivatives.
  Dual(double f, double by_x, const Dual& x, double by_y, const Dual& y) : value(f) {
    for (int i = 0; i < N; ++i) partials[i] = by_x * x.partials[i] + by_y * y.partials[i];
  }
  explicit operator double() const { return value; }

  Dual& operator+=(const Dual& b) { return *this = *this + b; }
  Dual& operator-=(const Dual& b) { return *this = *this - b; }
  Dual& operator*=(const Dual& b) { return *this = *this * b; }
  Dual& operator/=(const Dual& b) { return *this = *this / b; }

  friend Dual operator+(const Dual& a) { return a; }
  friend Dual operator-(const Dual& a) { return {-a.value, -1.0, a}; }
  friend Dual operator+(const Dual& a, const Dual& b) {
    Dual c;
    c.value = a.value + b.value;
    for (int i = 0; i < N; ++i) c.partials[i] = a.partials[i] + b.partials[i];
    return c;
  }
  friend Dual operator-(const Dual& a, const Dual& b) {
    Dual c;
    c.value = a.value - b.value;
    for (int i = 0; i < N; ++i) c.partials[i] = a.partials[i] - b.partials[i];
    return c;
  }
  friend Dual operator*(const Dual& a, const Dual& b) {
    return {a.value * b.value, b.value, a, a.value, b};
  }
  friend Dual operator/(const Dual& a, const Dual& b) {
    const double f = a.value / b.value, inverse = 1.0 / b.value;
    return {f, inverse, a, -f * inverse, b};
  }

  friend bool operator==(const Dual& a, const Dual& b) { return a.value == b.value; }
  friend std::partial_ordering operator<=>(const Dual& a, const Dual& b) {
    return a.value <=> b.value;
  }

  friend Dual sqrt(const Dual& x) {
    const double root = std::sqrt(x.value);
    return {root, root > 0.0 ? 0.5 / root : 0.0, x};
  }
  friend Dual sin(const Dual& x) { return {std::sin(x.value), std::cos(x.value), x}; }
  friend Dual cos(const Dual& x) { return {std::cos(x.value), -std::sin(x.value), x}; }
  friend Dual atan2(const Dual& y, const Dual& x) {
    const double square = x.value * x.value + y.value * y.value;
    return {std::atan2(y.value, x.value), x.value / square, y, -y.value / square, x};
  }
  friend Dual abs(const Dual& x) { return x.value < 0.0 ? -x : x; }
  friend Dual round(const Dual& x) { return std::round(x.value); }
  /// Of x over a constant.
  friend Dual remainder(const Dual& x, const Dual& y) {
    return {std::remainder(x.value, y.value), 1.0, x};
  }
  friend bool isfinite(const Dual& x) {
    bool finite = std::isfinite(x.value);
    for (int i = 0; i < N; ++i) finite = finite && std::isfinite(x.partials[i]);
    return finite;
  }
};

/// The scalar of Jacobians: eight directions are two registers of AVX.
using Forward = Dual<8>;

}  // namespace loopbench

template <int N>
inline constexpr double std::numbers::pi_v<loopbench::Dual<N>> = std::numbers::pi;

namespace Eigen {
template <int N>
struct NumTraits<loopbench::Dual<N>> : NumTraits<double> {
  using Real = loopbench::Dual<N>;
  using NonInteger = Real;
  using Nested = Real;
  using Literal = Real;
  enum { RequireInitialization = 0, ReadCost = N + 1, AddCost = N + 1, MulCost = 3 * N };
};
}  // namespace Eigen
