// Dual numbers: a value with its partial derivatives in eight directions. A template that is
// evaluated with them computes its own derivatives to round-off (forward differentiation; A.
// Griewank, A. Walther, Evaluating Derivatives, 2008, ch. 3).
//
// Comparisons use values alone, so that a program takes the same branches as with `double` and
// derivatives belong to that branch. The derivative of sqrt(0), which does not exist, is set to
// zero: this suits a force |v| v at zero speed.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <compare>
#include <numbers>

namespace loopbench {

/// Derivatives in eight directions, in two registers of AVX. Vectors of the compilers (GCC, clang):
/// written by components, a product of matrices was vectorised in ways that took ten times as long.
struct Partials {
  using Four [[gnu::vector_size(4 * sizeof(double)), gnu::aligned(alignof(double))]] = double;
  Four low, high;

  friend Partials operator+(const Partials& a, const Partials& b) {
    return {a.low + b.low, a.high + b.high};
  }
  friend Partials operator-(const Partials& a, const Partials& b) {
    return {a.low - b.low, a.high - b.high};
  }
  friend Partials operator-(const Partials& a) { return {-a.low, -a.high}; }
  friend Partials operator*(double a, const Partials& b) { return {a * b.low, a * b.high}; }
};

struct Dual {
  static constexpr int kWidth = 8;  ///< directions

  Partials partials;
  double value;

  Dual() = default;  // as indefinite as a double's
  Dual(double constant) : partials{}, value(constant) {}
  Dual(double f, const Partials& df) : partials(df), value(f) {}
  explicit operator double() const { return value; }

  double partial(int i) const { return i < 4 ? partials.low[i] : partials.high[i - 4]; }
  void SetPartial(int i, double slope) {  // not by ?:, which g++ 12 gets wrong with -fsanitize
    if (i < 4) {
      partials.low[i] = slope;
    } else {
      partials.high[i - 4] = slope;
    }
  }

  Dual& operator+=(const Dual& b) { return *this = *this + b; }
  Dual& operator-=(const Dual& b) { return *this = *this - b; }
  Dual& operator*=(const Dual& b) { return *this = *this * b; }
  Dual& operator/=(const Dual& b) { return *this = *this / b; }

  friend Dual operator+(const Dual& a) { return a; }
  friend Dual operator-(const Dual& a) { return {-a.value, -a.partials}; }
  friend Dual operator+(const Dual& a, const Dual& b) {
    return {a.value + b.value, a.partials + b.partials};
  }
  friend Dual operator-(const Dual& a, const Dual& b) {
    return {a.value - b.value, a.partials - b.partials};
  }
  friend Dual operator*(const Dual& a, const Dual& b) {
    return {a.value * b.value, b.value * a.partials + a.value * b.partials};
  }
  friend Dual operator/(const Dual& a, const Dual& b) {
    const double f = a.value / b.value, inverse = 1.0 / b.value;
    return {f, inverse * a.partials - f * inverse * b.partials};
  }

  friend bool operator==(const Dual& a, const Dual& b) { return a.value == b.value; }
  friend std::partial_ordering operator<=>(const Dual& a, const Dual& b) {
    return a.value <=> b.value;
  }

  friend Dual sqrt(const Dual& x) {
    const double root = std::sqrt(x.value);
    return {root, (root > 0.0 ? 0.5 / root : 0.0) * x.partials};
  }
  friend Dual sin(const Dual& x) { return {std::sin(x.value), std::cos(x.value) * x.partials}; }
  friend Dual cos(const Dual& x) { return {std::cos(x.value), -std::sin(x.value) * x.partials}; }
  friend Dual atan2(const Dual& y, const Dual& x) {
    const double square = x.value * x.value + y.value * y.value;
    return {std::atan2(y.value, x.value),
            x.value / square * y.partials - y.value / square * x.partials};
  }
  friend Dual abs(const Dual& x) { return x.value < 0.0 ? -x : x; }
  friend Dual round(const Dual& x) { return std::round(x.value); }
  /// Remainder of x over a constant.
  friend Dual remainder(const Dual& x, const Dual& y) {
    return {std::remainder(x.value, y.value), x.partials};
  }
};

}  // namespace loopbench

template <>
inline constexpr double std::numbers::pi_v<loopbench::Dual> = std::numbers::pi;

namespace Eigen {
template <>
struct NumTraits<loopbench::Dual> : NumTraits<double> {
  using Real = loopbench::Dual;
  using NonInteger = Real;
  using Nested = Real;
  using Literal = Real;
  enum {
    RequireInitialization = 0,
    ReadCost = loopbench::Dual::kWidth,
    AddCost = loopbench::Dual::kWidth,
    MulCost = 3 * loopbench::Dual::kWidth
  };
};
}  // namespace Eigen
