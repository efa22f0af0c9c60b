// Described functions of time: validation, and the spline of a table.
#include <algorithm>
#include <cmath>
#include <functional>
#include <span>

#include "mechanism/description/time_function.h"

namespace loopbench {

namespace {

bool AllFinite(const std::vector<double>& numbers) {
  return std::ranges::all_of(numbers, [](double x) { return std::isfinite(x); });
}

/// Second derivatives of the natural cubic spline: a tridiagonal system, diagonally dominant (de
/// Boor, A Practical Guide to Splines, ch. IV), by elimination without pivots.
std::vector<double> NaturalSpline(std::span<const double> t, std::span<const double> y) {
  const std::size_t n = t.size();
  std::vector<double> m(n, 0.0), upper(n, 0.0);
  for (std::size_t i = 1; i + 1 < n; ++i) {
    const double h0 = t[i] - t[i - 1], h1 = t[i + 1] - t[i];
    const double rhs = 6 * ((y[i + 1] - y[i]) / h1 - (y[i] - y[i - 1]) / h0);
    const double pivot = 2 * (h0 + h1) - h0 * upper[i - 1];
    upper[i] = h1 / pivot;
    m[i] = (rhs - h0 * m[i - 1]) / pivot;
  }
  for (std::size_t i = n - 1; i-- > 1;) m[i] -= upper[i] * m[i + 1];
  return m;
}

std::string Check(const Polynomial& f) {
  if (f.coefficients.empty()) return "a polynomial needs at least one coefficient";
  return AllFinite(f.coefficients) ? "" : "coefficients must be finite";
}
std::string Check(const Harmonic& f) {
  const bool finite = AllFinite({f.mean, f.amplitude, f.omega, f.phase});
  return finite ? "" : "mean, amplitude, omega and phase must be finite";
}
std::string Check(const TimeTable& f) {
  if (f.times.size() != f.values.size()) return "a table needs as many values as times";
  if (f.times.size() < 2) return "a table needs at least two points";
  if (!AllFinite(f.times) || !AllFinite(f.values)) return "times and values must be finite";
  const bool ascending =
      std::ranges::adjacent_find(f.times, std::greater_equal<>()) == f.times.end();
  return ascending ? "" : "times must ascend";
}

}  // namespace

std::string Validate(const TimeFunctionDescription& description) {
  return std::visit([](const auto& f) { return Check(f); }, description);
}

TimeFunction::TimeFunction(TimeFunctionDescription description)
    : description_(std::move(description)) {
  const auto* table = std::get_if<TimeTable>(&description_);
  if (table != nullptr && table->cubic) curvatures_ = NaturalSpline(table->times, table->values);
}

double TimeFunction::RateJump(double from, double to) const {
  const auto* table = std::get_if<TimeTable>(&description_);
  if (table == nullptr || table->cubic) return 0.0;
  return At(to).rate - At(from).rate;  // a rate is constant between knots
}

const std::vector<double>& TimeFunction::knots() const {
  static const std::vector<double> kNone;
  const auto* table = std::get_if<TimeTable>(&description_);
  return table != nullptr ? table->times : kNone;
}

}  // namespace loopbench
