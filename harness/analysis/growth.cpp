#include "harness/analysis/growth.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <stdexcept>

namespace loopbench::harness {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

// The running maximum at every sample, up to the first value that is not finite.
DriftSeries RunningMaximum(const DriftSeries& run) {
  if (run.t.size() != run.value.size()) {
    throw std::invalid_argument("a drift series has " + std::to_string(run.t.size()) +
                                " times and " + std::to_string(run.value.size()) + " values");
  }
  DriftSeries maximum;
  double largest = 0;
  for (size_t i = 0; i < run.t.size() && std::isfinite(run.value[i]); ++i) {
    largest = std::max(largest, std::abs(run.value[i]));
    maximum.t.push_back(run.t[i]);
    maximum.value.push_back(largest);
  }
  return maximum;
}

// The time of the first sample above `level`, or infinity.
double TimeAbove(const DriftSeries& maximum, double level) {
  const auto above = std::upper_bound(maximum.value.begin(), maximum.value.end(), level);
  return above == maximum.value.end() ? kInfinity
                                      : maximum.t[std::distance(maximum.value.begin(), above)];
}

// A running maximum read at `points` times from t_from to t_to, evenly in log t: at each, the
// value of the last sample that is not later.
DriftSeries Resample(const DriftSeries& maximum, double t_from, double t_to, int points) {
  DriftSeries samples;
  for (int i = 0; i < points; ++i) {
    // Both ends exactly; pow would miss the last sample by a round-off.
    const double t = i == points - 1
                         ? t_to
                         : t_from * std::pow(t_to / t_from, static_cast<double>(i) / (points - 1));
    const auto after = std::upper_bound(maximum.t.begin(), maximum.t.end(), t);
    if (after != maximum.t.begin()) {
      samples.t.push_back(t);
      samples.value.push_back(maximum.value[std::distance(maximum.t.begin(), after) - 1]);
    }
  }
  return samples;
}

double LogLogSlope(const DriftSeries& samples) {
  const auto count = static_cast<double>(samples.t.size());
  double mean_x = 0, mean_y = 0;
  for (size_t i = 0; i < samples.t.size(); ++i) {
    mean_x += std::log(samples.t[i]) / count;
    mean_y += std::log(samples.value[i]) / count;
  }
  double xx = 0, xy = 0;
  for (size_t i = 0; i < samples.t.size(); ++i) {
    const double x = std::log(samples.t[i]) - mean_x;
    xx += x * x;
    xy += x * (std::log(samples.value[i]) - mean_y);
  }
  return xy / xx;
}

struct Statistics {
  double mean;
  double spread;  // sample standard deviation; NaN for one value
};

std::vector<DriftSeries> Readings(std::span<const DriftSeries> maxima, double t_from, double t_to,
                                  int points) {
  std::vector<DriftSeries> readings;
  for (const DriftSeries& maximum : maxima) {
    readings.push_back(Resample(maximum, t_from, t_to, points));
  }
  return readings;
}

Statistics Slopes(std::span<const DriftSeries> readings) {
  const auto count = static_cast<double>(readings.size());
  std::vector<double> slopes;
  double mean = 0;
  for (const DriftSeries& member : readings) {
    slopes.push_back(LogLogSlope(member));
    mean += slopes.back() / count;
  }
  double squares = 0;
  for (const double slope : slopes) {
    squares += (slope - mean) * (slope - mean);
  }
  return {mean, count > 1 ? std::sqrt(squares / (count - 1)) : kNaN};
}

// The part of the runs that all members can use, and how each of its ends came about.
struct Usable {
  double t_from = 0;       // the last member leaves the floor
  double t_to = 0;         // the first member saturates or ends, or t_end
  bool saturates = false;  // before t_end
  double final_drift = 0;  // geometric mean of the final running maxima
};

Usable FindUsable(std::span<const DriftSeries> maxima, double t_end, double length,
                  const GrowthOptions& options) {
  const double floor = options.floor * std::numeric_limits<double>::epsilon() * length;
  Usable usable{.t_to = t_end};
  double log_final = 0;
  for (const DriftSeries& maximum : maxima) {
    const double t_saturated = TimeAbove(maximum, options.saturation * length);
    const double t_last = maximum.t.empty() ? 0 : maximum.t.back();
    usable.saturates = usable.saturates || t_saturated <= t_end;
    usable.t_from = std::max(usable.t_from, TimeAbove(maximum, floor));
    // The sample that saturates is the first one not to be used.
    usable.t_to = std::min({usable.t_to, std::nextafter(t_saturated, 0.0), t_last});
    log_final += std::log(maximum.value.empty() ? 0 : maximum.value.back());
  }
  usable.final_drift = std::exp(log_final / static_cast<double>(maxima.size()));
  return usable;
}

bool IsTooShort(std::span<const DriftSeries> maxima, double t_from, double t_to,
                const GrowthOptions& options) {
  if (!(t_to >= options.shortest_ratio * t_from && t_from > 0)) {
    return true;
  }
  return std::any_of(maxima.begin(), maxima.end(), [&](const DriftSeries& maximum) {
    const auto samples = std::count_if(maximum.t.begin(), maximum.t.end(), [&](double t) {
      return t >= options.late_window_start * t_to && t <= t_to;
    });
    return samples < options.fewest_samples;
  });
}

bool IsResolved(const Growth& growth, const GrowthOptions& options) {
  if (growth.members < options.fewest_members) {
    return false;
  }
  const double s = std::hypot(growth.spread, growth.spread_late) / std::sqrt(2.0);
  const double error = std::max(growth.spread, growth.spread_late) / std::sqrt(growth.members);
  // False if anything is NaN.
  return std::abs(growth.exponent - growth.exponent_late) <= std::max(s, options.slope_bias) &&
         error <= options.largest_error;
}

}  // namespace

Growth AnalyseGrowth(std::span<const DriftSeries> runs, double t_end, double length,
                     const GrowthOptions& options) {
  if (!(length > 0)) {
    throw std::invalid_argument("length is " + std::to_string(length) + "; it must be positive");
  }
  Growth growth{.exponent = kNaN,
                .spread = kNaN,
                .exponent_late = kNaN,
                .spread_late = kNaN,
                .resolved = false,
                .regime = "too-short",
                .members = static_cast<int>(runs.size()),
                .t_from = kNaN,
                .t_to = kNaN,
                .hypothesis = {.ratio = kNaN, .rate = kNaN},
                .hypothesis_resolved = false};
  std::vector<DriftSeries> maxima;
  std::transform(runs.begin(), runs.end(), std::back_inserter(maxima), RunningMaximum);
  if (maxima.empty()) {
    return growth;
  }
  const Usable usable = FindUsable(maxima, t_end, length, options);
  const double t_to = usable.t_to;
  const double t_from = std::max(usable.t_from, options.window_start * t_to);
  const bool too_short = IsTooShort(maxima, t_from, t_to, options);
  if (!too_short) {
    const double t_late = std::max(t_from, options.late_window_start * t_to);
    const std::vector<DriftSeries> readings = Readings(maxima, t_from, t_to, options.points);
    const Statistics whole = Slopes(readings);
    const Statistics late = Slopes(Readings(maxima, t_late, t_to, options.points));
    growth.exponent = whole.mean;
    growth.spread = whole.spread;
    growth.exponent_late = late.mean;
    growth.spread_late = late.spread;
    growth.t_from = t_from;
    growth.t_to = t_to;
    growth.resolved = IsResolved(growth, options);
    growth.hypothesis = CompareHypotheses(readings, whole.mean, options.hypotheses);
    growth.hypothesis_resolved = growth.hypothesis.refutes_rivals &&
                                 (growth.hypothesis.name == "exponential" || growth.resolved);
    growth.regime = usable.saturates ? "saturated" : "truncation";
  }
  if (usable.final_drift < options.round_off * std::numeric_limits<double>::epsilon() * length) {
    growth.regime = "round-off";
  }
  return growth;
}

DriftSeries Envelope(const DriftSeries& series, int points) {
  const DriftSeries maximum = RunningMaximum(series);
  const auto first = std::upper_bound(maximum.t.begin(), maximum.t.end(), 0.0);
  if (points < 2 || std::distance(first, maximum.t.end()) < 2) {
    return {};
  }
  return Resample(maximum, *first, maximum.t.back(), points);
}

}  // namespace loopbench::harness
