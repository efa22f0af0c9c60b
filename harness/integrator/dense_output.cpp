#include "harness/integrator/dense_output.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace loopbench::harness {
namespace {

// w = theta^2 (1 - theta)^2 vanishes with its derivative at both ends, so p + w (a + b theta)
// leaves the ends of a cubic p as they are. Its derivative at theta = 1/2 is zero: a derivative
// there says nothing of the factor, those at 1/3 and 2/3 do.
double W(double theta) { return theta * theta * (1 - theta) * (1 - theta); }
double DW(double theta) { return 2 * theta * (1 - theta) * (1 - 2 * theta); }
constexpr double kFirst = 1.0 / 3.0, kSecond = 2.0 / 3.0;

}  // namespace

void DenseOutput::Cubic(double theta, std::span<double> y) const {
  const double s = 1 - theta;
  for (std::size_t i = 0; i < y0_.size(); ++i) {
    const double rise = y1_[i] - y0_[i];
    y[i] =
        y0_[i] + theta * theta * (3 - 2 * theta) * rise + theta * s * (s * f0_[i] - theta * f1_[i]);
  }
}

bool DenseOutput::Prepare(double t0, std::span<const double> y0, double t1,
                          std::span<const double> y1, const Derivative& derivative) {
  t0_ = t0;
  h_ = t1 - t0;
  y0_.assign(y0.begin(), y0.end());
  y1_.assign(y1.begin(), y1.end());
  const std::size_t n = y0_.size();
  f0_.resize(n), f1_.resize(n), bump_.assign(n, 0.0), flat_.assign(n, 0.0), sloping_.assign(n, 0.0);
  std::vector<double> y(n), rate(n);
  const auto scaled = [&](double t, std::span<const double> at, std::vector<double>& f) {
    if (!derivative(t, at, f)) return false;
    for (double& value : f) value *= h_;
    return std::ranges::all_of(f, [](double value) { return std::isfinite(value); });
  };
  constexpr double kBack = -std::numeric_limits<double>::infinity();
  if (!scaled(t0, y0_, f0_) || !scaled(std::nextafter(t1, kBack), y1_, f1_)) return false;
  // what the derivative at a point of the curve wants beyond the cubic's own
  const auto excess = [&](double theta, std::vector<double>& more) {
    Cubic(theta, y);
    for (std::size_t i = 0; i < n; ++i) y[i] += W(theta) * bump_[i];
    if (!scaled(t0_ + theta * h_, y, rate)) return false;
    more.resize(n);
    for (std::size_t i = 0; i < n; ++i) {
      const double own = 6 * theta * (1 - theta) * (y1_[i] - y0_[i]) +
                         (1 - theta) * (1 - 3 * theta) * f0_[i] + theta * (3 * theta - 2) * f1_[i];
      more[i] = rate[i] - own;
    }
    return true;
  };
  std::vector<double> first, second;
  if (!excess(kFirst, first)) return false;
  for (std::size_t i = 0; i < n; ++i) bump_[i] = first[i] / DW(kFirst);
  if (!excess(kFirst, first) || !excess(kSecond, second)) return false;
  // (w (a + b theta))' = w' a + (w' theta + w) b at both points
  const double a1 = DW(kFirst), b1 = a1 * kFirst + W(kFirst);
  const double a2 = DW(kSecond), b2 = a2 * kSecond + W(kSecond);
  const double determinant = a1 * b2 - a2 * b1;
  for (std::size_t i = 0; i < n; ++i) {
    flat_[i] = (first[i] * b2 - second[i] * b1) / determinant;
    sloping_[i] = (a1 * second[i] - a2 * first[i]) / determinant;
  }
  return true;
}

void DenseOutput::At(double t, std::span<double> y, std::span<double> lower) const {
  const double theta = (t - t0_) / h_;
  Cubic(theta, y);
  for (std::size_t i = 0; i < y0_.size(); ++i) {
    lower[i] = y[i] + W(theta) * bump_[i];
    y[i] += W(theta) * (flat_[i] + theta * sloping_[i]);
  }
}

}  // namespace loopbench::harness
