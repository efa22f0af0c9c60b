#include "mechanism/time_function.h"

#include <algorithm>
#include <cmath>
#include <span>

#include "mechanism/instantiate.h"

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

template <class S>
TimeValue<S> At(const Polynomial& f, const std::vector<double>&, S t) {
  TimeValue<S> y;  // Horner's scheme, with derivatives
  for (auto c = f.coefficients.rbegin(); c != f.coefficients.rend(); ++c) {
    y.acceleration = y.acceleration * t + S(2) * y.rate;
    y.rate = y.rate * t + y.value;
    y.value = y.value * t + S(*c);
  }
  return y;
}

template <class S>
TimeValue<S> At(const Harmonic& f, const std::vector<double>&, S t) {
  using std::cos;
  using std::sin;
  const S omega = S(f.omega), angle = omega * t + S(f.phase);
  const S part = S(f.amplitude) * sin(angle);
  return {S(f.mean) + part, S(f.amplitude) * omega * cos(angle), -omega * omega * part};
}

/// The table between its points i and i + 1.
template <class S>
TimeValue<S> Piece(const TimeTable& f, const std::vector<double>& curvatures, std::size_t i, S t) {
  const S h = S(f.times[i + 1]) - S(f.times[i]);
  const S a = (S(f.times[i + 1]) - t) / h, b = (t - S(f.times[i])) / h;
  const S y0 = S(f.values[i]), y1 = S(f.values[i + 1]);
  TimeValue<S> y{a * y0 + b * y1, (y1 - y0) / h, S(0)};
  if (!f.cubic) return y;
  const S m0 = S(curvatures[i]), m1 = S(curvatures[i + 1]);
  y.value += ((a * a * a - a) * m0 + (b * b * b - b) * m1) * h * h / S(6);
  y.rate += ((S(3) * b * b - S(1)) * m1 - (S(3) * a * a - S(1)) * m0) * h / S(6);
  y.acceleration = a * m0 + b * m1;
  return y;
}

template <class S>
TimeValue<S> At(const TimeTable& f, const std::vector<double>& curvatures, S t) {
  const std::size_t last = f.times.size() - 1;
  const bool before = t < S(f.times.front()), beyond = t >= S(f.times.back());
  if (!f.cubic && (before || beyond)) return {S(f.values[before ? 0 : last]), S(0), S(0)};
  if (before || beyond) {  // along the tangent at the end: the spline has no curvature there
    const TimeValue<S> end =
        Piece<S>(f, curvatures, before ? 0 : last - 1, S(f.times[before ? 0 : last]));
    return {end.value + end.rate * (t - S(f.times[before ? 0 : last])), end.rate, S(0)};
  }
  const auto after = std::ranges::upper_bound(
      f.times, t, [](const S& a, const S& b) { return a < b; }, [](double x) { return S(x); });
  return Piece<S>(f, curvatures, static_cast<std::size_t>(after - f.times.begin()) - 1, t);
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

const std::vector<double>& TimeFunction::knots() const {
  static const std::vector<double> kNone;
  const auto* table = std::get_if<TimeTable>(&description_);
  return table != nullptr ? table->times : kNone;
}

template <class S>
TimeValue<S> TimeFunction::At(S t) const {
  return std::visit([&](const auto& f) { return loopbench::At<S>(f, curvatures_, t); },
                    description_);
}

#define LOOPBENCH_INSTANTIATE(S) template TimeValue<S> TimeFunction::At(S t) const;
LOOPBENCH_FOR_EACH_SCALAR(LOOPBENCH_INSTANTIATE)
LOOPBENCH_INSTANTIATE(Dual)
#undef LOOPBENCH_INSTANTIATE

}  // namespace loopbench
