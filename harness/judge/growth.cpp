#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <limits>
#include <map>
#include <stdexcept>
#include <utility>
#include <vector>

#include "harness/base/text.h"
#include "harness/judge/analysis.h"

namespace loopbench::harness {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

constexpr std::array<double, 4> kExponents = {0.5, 1.0, 1.5, 2.0};
constexpr std::array<const char*, 5> kNames = {"t^0.5", "t^1", "t^1.5", "t^2", "exponential"};
constexpr std::size_t kExponential = kExponents.size();
constexpr std::size_t kHypotheses = kNames.size();

// Residuals below this are a perfect fit; their logarithm would be minus infinity.
constexpr double kMinMeanSquare = 1e-20;

// Least squares of y over x with a free offset: slope and mean square residual.
struct Line {
  double slope;
  double mean_square;
};

double Mean(const std::vector<double>& values) {
  double sum = 0;
  for (const double value : values) sum += value;
  return sum / static_cast<double>(values.size());
}

Line FitLine(const std::vector<double>& x, const std::vector<double>& y) {
  const double mean_x = Mean(x), mean_y = Mean(y);
  double xx = 0, xy = 0, yy = 0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    xx += (x[i] - mean_x) * (x[i] - mean_x);
    xy += (x[i] - mean_x) * (y[i] - mean_y);
    yy += (y[i] - mean_y) * (y[i] - mean_y);
  }
  const double slope = xy / xx;
  return {slope, std::max(0.0, yy - slope * xy) / static_cast<double>(x.size())};
}

// Variance of y - slope x: the mean square residual of a line with that slope and a free offset.
double MeanSquareAtSlope(const std::vector<double>& x, const std::vector<double>& y, double slope) {
  std::vector<double> rest(x.size());
  for (std::size_t i = 0; i < x.size(); ++i) rest[i] = y[i] - slope * x[i];
  const double mean = Mean(rest);
  double squares = 0;
  for (const double value : rest) squares += (value - mean) * (value - mean);
  return squares / static_cast<double>(x.size());
}

// One member: scores of the hypotheses, of a power law with a free exponent, and e^(k t)'s k.
struct Scores {
  std::array<double, kHypotheses> of;
  std::array<double, kHypotheses> log_mean_square;
  double free_power;
  double rate;
  double growth;  // k times the window's length
};

Scores ScoreMember(const DriftSeries& readings, const HypothesisOptions& options) {
  std::vector<double> log_t, log_drift;
  for (std::size_t i = 0; i < readings.t.size(); ++i) {
    log_t.push_back(std::log(readings.t[i]));
    log_drift.push_back(std::log(readings.value[i]));
  }
  const double price = std::log(options.independent_readings) / options.independent_readings;
  const auto log_of = [](double square) { return std::log(std::max(square, kMinMeanSquare)); };
  Scores scores{};
  for (std::size_t h = 0; h < kExponents.size(); ++h) {
    scores.log_mean_square[h] = log_of(MeanSquareAtSlope(log_t, log_drift, kExponents[h]));
    scores.of[h] = scores.log_mean_square[h] + price;
  }
  const Line exponential = FitLine(readings.t, log_drift);
  scores.log_mean_square[kExponential] = log_of(exponential.mean_square);
  scores.of[kExponential] = scores.log_mean_square[kExponential] + 2 * price;
  scores.free_power = log_of(FitLine(log_t, log_drift).mean_square) + 2 * price;
  scores.rate = exponential.slope;
  scores.growth = exponential.slope * (readings.t.back() - readings.t.front());
  return scores;
}

template <class Get>
std::vector<double> Collect(const std::vector<Scores>& members, const Get& get) {
  return Mapped<double>(members, [&](const Scores& member) { return get(member); });
}

// Returns true if the mean of the values exceeds zero by so many standard errors.
bool IsPositive(const std::vector<double>& values, double standard_errors) {
  const double mean = Mean(values), count = static_cast<double>(values.size());
  double squares = 0;
  for (const double value : values) squares += (value - mean) * (value - mean);
  return mean > standard_errors * std::sqrt(squares / (count - 1) / count);
}

// Returns true if the winner describes the data.
bool Holds(std::size_t winner, const std::vector<Scores>& members, double exponent,
           const HypothesisOptions& options) {
  if (winner != kExponential) {
    return std::abs(exponent - kExponents[winner]) <= options.exponent_tolerance;
  }
  const double growth = Mean(Collect(members, [](const Scores& m) { return m.growth; }));
  const double margin =
      Mean(Collect(members, [](const Scores& m) { return m.free_power - m.of[kExponential]; }));
  return growth >= std::log(options.least_factor) && margin > 0;
}

}  // namespace

Hypothesis CompareHypotheses(std::span<const DriftSeries> readings, double exponent,
                             const HypothesisOptions& options) {
  Hypothesis answer{.ratio = kNaN, .rate = kNaN};
  std::vector<Scores> members;
  for (const DriftSeries& member : readings) {
    if (member.t.size() < 3) return answer;
    members.push_back(ScoreMember(member, options));
  }
  if (members.empty()) return answer;

  const auto mean_score = [&](std::size_t h) {
    return Mean(Collect(members, [h](const Scores& m) { return m.of[h]; }));
  };
  std::size_t winner = 0;
  for (std::size_t h = 1; h < kHypotheses; ++h) {
    if (mean_score(h) < mean_score(winner)) winner = h;
  }
  double lead = std::numeric_limits<double>::infinity();  // of log mean squares
  bool refutes = static_cast<int>(members.size()) >= options.fewest_members;
  for (std::size_t h = 0; h < kHypotheses; ++h) {
    if (h == winner) continue;
    const auto lag = [&](const auto& list) {
      return Collect(members, [&](const Scores& m) { return (m.*list)[h] - (m.*list)[winner]; });
    };
    refutes = refutes && IsPositive(lag(&Scores::of), options.standard_errors);
    lead = std::min(lead, Mean(lag(&Scores::log_mean_square)));
  }
  answer.ratio = std::exp(lead / 2);
  answer.rate = Mean(Collect(members, [](const Scores& m) { return m.rate; }));
  if (Holds(winner, members, exponent, options)) {
    answer.name = kNames[winner];
    answer.refutes_rivals = refutes;
  }
  return answer;
}
namespace {

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
  return Mapped<DriftSeries>(
      maxima, [&](const DriftSeries& maximum) { return Resample(maximum, t_from, t_to, points); });
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
  // false if anything is NaN
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

namespace {

/// (log size, mean log cost), by growing size.
std::vector<std::pair<double, double>> LogPoints(std::span<const double> sizes,
                                                 std::span<const double> costs) {
  std::map<double, std::pair<double, int>> sums;
  for (std::size_t i = 0; i < std::min(sizes.size(), costs.size()); ++i) {
    const double x = std::log(sizes[i]), y = std::log(costs[i]);
    if (!std::isfinite(x) || !std::isfinite(y)) continue;
    auto& [sum, count] = sums[x];
    sum += y;
    ++count;
  }
  std::vector<std::pair<double, double>> points;
  for (const auto& [x, sum] : sums) points.emplace_back(x, sum.first / sum.second);
  return points;
}

}  // namespace

PowerFit FitPower(std::span<const double> sizes, std::span<const double> costs) {
  const auto points = LogPoints(sizes, costs);
  PowerFit fit;
  fit.sizes = static_cast<int>(points.size());
  if (points.size() < 2) {
    fit.smallest = fit.largest = points.empty() ? kNaN : std::exp(points[0].first);
    fit.exponent = fit.standard_error = fit.coefficient = fit.slope_min = fit.slope_max = kNaN;
    return fit;
  }
  fit.smallest = std::exp(points.front().first);
  fit.largest = std::exp(points.back().first);
  const double n = static_cast<double>(points.size());
  double x_mean = 0.0, y_mean = 0.0, xx = 0.0, xy = 0.0, rest = 0.0;
  for (const auto& [x, y] : points) {
    x_mean += x / n;
    y_mean += y / n;
  }
  for (const auto& [x, y] : points) {
    xx += (x - x_mean) * (x - x_mean);
    xy += (x - x_mean) * (y - y_mean);
  }
  fit.exponent = xy / xx;
  fit.coefficient = std::exp(y_mean - fit.exponent * x_mean);
  fit.slope_min = std::numeric_limits<double>::infinity();
  fit.slope_max = -fit.slope_min;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const auto& [x, y] = points[i];
    const double residual = y - y_mean - fit.exponent * (x - x_mean);
    rest += residual * residual;
    if (i == 0) continue;
    const double slope = (y - points[i - 1].second) / (x - points[i - 1].first);
    fit.slope_min = std::min(fit.slope_min, slope);
    fit.slope_max = std::max(fit.slope_max, slope);
  }
  fit.standard_error = points.size() > 2 ? std::sqrt(rest / (n - 2.0) / xx) : kNaN;
  return fit;
}

}  // namespace loopbench::harness
