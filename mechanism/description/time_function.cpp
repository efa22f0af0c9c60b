// Values and derivatives at a time.
#include "mechanism/description/time_function.h"

#include <algorithm>
#include <cmath>

#include "mechanism/algebra/instantiate.h"

namespace loopbench {

namespace {

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

}  // namespace

template <class S>
TimeValue<S> TimeFunction::At(S t) const {
  return std::visit([&](const auto& f) { return loopbench::At<S>(f, curvatures_, t); },
                    description_);
}

#define LOOPBENCH_INSTANTIATE(S) template TimeValue<S> TimeFunction::At(S t) const;
LOOPBENCH_FOR_EACH_MODEL_SCALAR(LOOPBENCH_INSTANTIATE)
#undef LOOPBENCH_INSTANTIATE

}  // namespace loopbench
