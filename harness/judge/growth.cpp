#include <algorithm>
#include <array>
#include <cmath>
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
constexpr double kInfinity = std::numeric_limits<double>::infinity();

constexpr std::array<double, 4> kExponents = {0.5, 1.0, 1.5, 2.0};
constexpr std::array<const char*, 5> kNames = {"t^0.5", "t^1", "t^1.5", "t^2", "exponential"};
constexpr std::size_t kExponential = kExponents.size();
constexpr std::size_t kHypotheses = kNames.size();

/// Residuals below this are a perfect fit; their logarithm would be minus infinity.
constexpr double kMinMeanSquare = 1e-20;
/// Readings of a running maximum are correlated. 64 readings over about ten swings carry the
/// information of this many independent ones. Used only for the penalty of a parameter.
constexpr double kIndependentReadings = 16;
/// Maximum distance of the fitted exponent from an accepted hypothesis. It covers the bias of a
/// running maximum (0.05) and of finite windows (1.84 to 2.08 instead of 2).
constexpr double kExponentTolerance = 0.15;
/// Logarithm of the minimum growth of e^(k t) within the window; slower growth looks like a
/// plateau.
constexpr double kLeastGrowth = 1.0;
/// A rival is refuted when its mean score lags by so many standard errors: 99 % for 8 members
/// (Student's t, one-sided, 7 degrees of freedom: 3.0), more for more.
constexpr double kStandardErrors = 3.0;
/// Fewer members than this refute nothing and resolve no exponent.
constexpr int kFewestMembers = 8;

double Mean(const std::vector<double>& values) {
  double sum = 0;
  for (const double value : values) sum += value;
  return sum / static_cast<double>(values.size());
}

double SquaresAbout(double mean, const std::vector<double>& values) {
  double squares = 0;
  for (const double value : values) squares += (value - mean) * (value - mean);
  return squares;
}

/// Least squares of y over x with a free offset: slope and mean square residual.
struct Line {
  double slope;
  double mean_square;
};

Line FitLine(const std::vector<double>& x, const std::vector<double>& y) {
  const double mean_x = Mean(x), mean_y = Mean(y);
  double xy = 0;
  for (std::size_t i = 0; i < x.size(); ++i) xy += (x[i] - mean_x) * (y[i] - mean_y);
  const double slope = xy / SquaresAbout(mean_x, x);
  return {slope,
          std::max(0.0, SquaresAbout(mean_y, y) - slope * xy) / static_cast<double>(x.size())};
}

/// Returns the mean square residual of a line with that slope and a free offset.
double MeanSquareAtSlope(const std::vector<double>& x, const std::vector<double>& y, double slope) {
  std::vector<double> rest(x.size());
  for (std::size_t i = 0; i < x.size(); ++i) rest[i] = y[i] - slope * x[i];
  return SquaresAbout(Mean(rest), rest) / static_cast<double>(x.size());
}

/// Scores of one member: of the hypotheses, of a power law with a free exponent, and e^(k t)'s k.
struct Scores {
  std::array<double, kHypotheses> of;
  std::array<double, kHypotheses> log_mean_square;
  double free_power;
  double rate;
  double growth;  ///< k times the window's length
};

Scores ScoreMember(const DriftSeries& readings) {
  const auto log = [](double value) { return std::log(value); };
  const std::vector<double> log_t = Mapped<double>(readings.t, log),
                            log_drift = Mapped<double>(readings.value, log);
  const double price = std::log(kIndependentReadings) / kIndependentReadings;
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
double MeanOf(const std::vector<Scores>& members, const Get& get) {
  return Mean(Mapped<double>(members, get));
}

/// Returns true if the mean of the values exceeds zero by kStandardErrors.
bool IsPositive(const std::vector<double>& values) {
  const double mean = Mean(values), count = static_cast<double>(values.size());
  return mean > kStandardErrors * std::sqrt(SquaresAbout(mean, values) / (count - 1) / count);
}

bool Holds(std::size_t winner, const std::vector<Scores>& members, double exponent) {
  if (winner != kExponential) {
    return std::abs(exponent - kExponents[winner]) <= kExponentTolerance;
  }
  const auto margin = [](const Scores& m) { return m.free_power - m.of[kExponential]; };
  return MeanOf(members, &Scores::growth) >= kLeastGrowth && MeanOf(members, margin) > 0;
}

}  // namespace

Hypothesis CompareHypotheses(std::span<const DriftSeries> readings, double exponent) {
  Hypothesis answer;
  const bool is_short =
      std::ranges::any_of(readings, [](const DriftSeries& member) { return member.t.size() < 3; });
  if (is_short || readings.empty()) return answer;
  const std::vector<Scores> members = Mapped<Scores>(readings, ScoreMember);

  const auto mean_score = [&](std::size_t h) {
    return MeanOf(members, [h](const Scores& m) { return m.of[h]; });
  };
  std::size_t winner = 0;
  for (std::size_t h = 1; h < kHypotheses; ++h) {
    if (mean_score(h) < mean_score(winner)) winner = h;
  }
  double lead = kInfinity;  // of log mean squares
  bool refutes = static_cast<int>(members.size()) >= kFewestMembers;
  for (std::size_t h = 0; h < kHypotheses; ++h) {
    if (h == winner) continue;
    const auto lag = [&](const auto& list) {
      return Mapped<double>(members,
                            [&](const Scores& m) { return (m.*list)[h] - (m.*list)[winner]; });
    };
    refutes = refutes && IsPositive(lag(&Scores::of));
    lead = std::min(lead, Mean(lag(&Scores::log_mean_square)));
  }
  answer.ratio = std::exp(lead / 2);
  answer.rate = MeanOf(members, &Scores::rate);
  if (Holds(winner, members, exponent)) {
    answer.name = kNames[winner];
    answer.refutes_rivals = refutes;
  }
  return answer;
}

// Exponents of ensembles. Fractions of time refer to the end of the usable part of the runs.

namespace {

/// Starts of the two windows. Earlier growth is affected by the few first steps and by a first
/// swing that may differ from later ones.
constexpr double kWindowStart = 0.1, kLateWindowStart = 0.5;
/// Number of times at which the running maximum is read, evenly spaced in log t for equal weight
/// per decade. The integrator's own samples would give the last decade nine tenths.
constexpr int kPoints = 64;
/// Drift above this fraction of the length is no longer small, and stops growing: cut off.
constexpr double kSaturation = 0.1;
/// Drift below this many round-offs of the length is the evaluation's own noise: cut off.
constexpr double kFloor = 10;
/// "too-short" unless the first window's end is this many times its start (saturation and floor
/// may have clipped it) and every run has this many samples in the late window.
constexpr double kShortestRatio = 4;
constexpr int kFewestSamples = 16;
/// Means of the two windows that differ by less than this agree even if the spread is smaller.
/// The running maximum of a drift with period P lags by up to P: that raises a slope p by some
/// p P / (2 t) in windows from t on, 0.04 for p = 2 and seven periods.
constexpr double kSlopeBias = 0.05;
/// Largest standard error of either mean. Exponents that theory offers (1/2, 1, 3/2, 2) lie half
/// a unit apart; two standard errors must stay within half of that.
constexpr double kLargestError = 0.125;

/// Returns the running maximum at every sample, up to the first value that is not finite.
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

/// Returns the time of the first sample above `level`, or infinity.
double TimeAbove(const DriftSeries& maximum, double level) {
  const auto above = std::ranges::upper_bound(maximum.value, level);
  return above == maximum.value.end() ? kInfinity : maximum.t[above - maximum.value.begin()];
}

/// Returns a running maximum read at `points` times from t_from to t_to, evenly in log t: at each,
/// the value of the last sample that is not later.
DriftSeries Resample(const DriftSeries& maximum, double t_from, double t_to, int points) {
  DriftSeries samples;
  for (int i = 0; i < points; ++i) {
    // both ends exactly; pow would miss the last sample by a round-off
    const double t = i == points - 1
                         ? t_to
                         : t_from * std::pow(t_to / t_from, static_cast<double>(i) / (points - 1));
    const auto after = std::ranges::upper_bound(maximum.t, t);
    if (after == maximum.t.begin()) continue;
    samples.t.push_back(t);
    samples.value.push_back(maximum.value[after - maximum.t.begin() - 1]);
  }
  return samples;
}

/// Logarithms of two quantities, and sums over their distances from their means.
struct LogLog {
  std::vector<std::pair<double, double>> points;
  double x_mean = 0.0, y_mean = 0.0, xx = 0.0, xy = 0.0;

  explicit LogLog(std::vector<std::pair<double, double>> logarithms)
      : points(std::move(logarithms)) {
    const auto count = static_cast<double>(points.size());
    for (const auto& [x, y] : points) {
      x_mean += x / count;
      y_mean += y / count;
    }
    for (const auto& [x, y] : points) {
      xx += (x - x_mean) * (x - x_mean);
      xy += (x - x_mean) * (y - y_mean);
    }
  }
  double Slope() const { return xy / xx; }
};

std::vector<DriftSeries> Readings(std::span<const DriftSeries> maxima, double t_from, double t_to) {
  return Mapped<DriftSeries>(
      maxima, [&](const DriftSeries& maximum) { return Resample(maximum, t_from, t_to, kPoints); });
}

/// Sets mean and sample standard deviation (NaN for one value) of the slopes.
void SetSlopes(std::span<const DriftSeries> readings, double* mean, double* spread) {
  const auto count = static_cast<double>(readings.size());
  std::vector<double> slopes;
  *mean = 0;
  for (const DriftSeries& member : readings) {
    std::vector<std::pair<double, double>> points;
    for (std::size_t i = 0; i < member.t.size(); ++i) {
      points.emplace_back(std::log(member.t[i]), std::log(member.value[i]));
    }
    slopes.push_back(LogLog(std::move(points)).Slope());
    *mean += slopes.back() / count;
  }
  *spread = count > 1 ? std::sqrt(SquaresAbout(*mean, slopes) / (count - 1)) : kNaN;
}

/// The part of the runs that all members can use, and how each of its ends came about.
struct Usable {
  double t_from = 0;       ///< the last member leaves the floor
  double t_to = 0;         ///< the first member saturates or ends, or t_end
  bool saturates = false;  ///< before t_end
  double final_drift = 0;  ///< geometric mean of the final running maxima
};

Usable FindUsable(std::span<const DriftSeries> maxima, double t_end, double length) {
  const double floor = kFloor * std::numeric_limits<double>::epsilon() * length;
  Usable usable{.t_to = t_end};
  double log_final = 0;
  for (const DriftSeries& maximum : maxima) {
    const double t_saturated = TimeAbove(maximum, kSaturation * length);
    const double t_last = maximum.t.empty() ? 0 : maximum.t.back();
    usable.saturates = usable.saturates || t_saturated <= t_end;
    usable.t_from = std::max(usable.t_from, TimeAbove(maximum, floor));
    // the sample that saturates is the first one not to be used
    usable.t_to = std::min({usable.t_to, std::nextafter(t_saturated, 0.0), t_last});
    log_final += std::log(maximum.value.empty() ? 0 : maximum.value.back());
  }
  usable.final_drift = std::exp(log_final / static_cast<double>(maxima.size()));
  return usable;
}

bool IsTooShort(std::span<const DriftSeries> maxima, double t_from, double t_to) {
  if (!(t_to >= kShortestRatio * t_from && t_from > 0)) return true;
  return std::ranges::any_of(maxima, [&](const DriftSeries& maximum) {
    const auto samples = std::ranges::count_if(
        maximum.t, [&](double t) { return t >= kLateWindowStart * t_to && t <= t_to; });
    return samples < kFewestSamples;
  });
}

bool IsResolved(const Growth& growth) {
  if (growth.members < kFewestMembers) return false;
  const double s = std::hypot(growth.spread, growth.spread_late) / std::sqrt(2.0);
  const double error = std::max(growth.spread, growth.spread_late) / std::sqrt(growth.members);
  // false if anything is NaN
  return std::abs(growth.exponent - growth.exponent_late) <= std::max(s, kSlopeBias) &&
         error <= kLargestError;
}

}  // namespace

Growth AnalyseGrowth(std::span<const DriftSeries> runs, double t_end, double length,
                     double round_off) {
  if (!(length > 0)) {
    throw std::invalid_argument("length is " + std::to_string(length) + "; it must be positive");
  }
  Growth growth;
  growth.members = static_cast<int>(runs.size());
  if (runs.empty()) return growth;
  const std::vector<DriftSeries> maxima = Mapped<DriftSeries>(runs, RunningMaximum);
  const Usable usable = FindUsable(maxima, t_end, length);
  const double t_to = usable.t_to;
  const double t_from = std::max(usable.t_from, kWindowStart * t_to);
  if (!IsTooShort(maxima, t_from, t_to)) {
    const double t_late = std::max(t_from, kLateWindowStart * t_to);
    const std::vector<DriftSeries> readings = Readings(maxima, t_from, t_to);
    SetSlopes(readings, &growth.exponent, &growth.spread);
    SetSlopes(Readings(maxima, t_late, t_to), &growth.exponent_late, &growth.spread_late);
    growth.t_from = t_from;
    growth.t_to = t_to;
    growth.resolved = IsResolved(growth);
    growth.hypothesis = CompareHypotheses(readings, growth.exponent);
    growth.hypothesis_resolved = growth.hypothesis.refutes_rivals &&
                                 (growth.hypothesis.name == "exponential" || growth.resolved);
    growth.regime = usable.saturates ? "saturated" : "truncation";
  }
  if (usable.final_drift < round_off * std::numeric_limits<double>::epsilon() * length) {
    growth.regime = "round-off";
  }
  return growth;
}

DriftSeries Envelope(const DriftSeries& series, int points) {
  const DriftSeries maximum = RunningMaximum(series);
  const auto first = std::ranges::upper_bound(maximum.t, 0.0);
  if (points < 2 || maximum.t.end() - first < 2) return {};
  return Resample(maximum, *first, maximum.t.back(), points);
}

PowerFit FitPower(std::span<const double> sizes, std::span<const double> costs) {
  std::map<double, std::pair<double, int>> sums;  // of log costs, and their number, by log size
  for (std::size_t i = 0; i < std::min(sizes.size(), costs.size()); ++i) {
    const double x = std::log(sizes[i]), y = std::log(costs[i]);
    if (!std::isfinite(x) || !std::isfinite(y)) continue;
    auto& [sum, count] = sums[x];
    sum += y;
    ++count;
  }
  std::vector<std::pair<double, double>> means;
  for (const auto& [x, sum] : sums) means.emplace_back(x, sum.first / sum.second);
  const LogLog fitted(std::move(means));
  const auto& points = fitted.points;
  PowerFit fit;
  fit.sizes = static_cast<int>(points.size());
  if (points.size() < 2) {
    fit.smallest = fit.largest = points.empty() ? kNaN : std::exp(points[0].first);
    fit.exponent = fit.standard_error = fit.coefficient = fit.slope_min = fit.slope_max = kNaN;
    return fit;
  }
  fit.smallest = std::exp(points.front().first);
  fit.largest = std::exp(points.back().first);
  fit.exponent = fitted.Slope();
  fit.coefficient = std::exp(fitted.y_mean - fit.exponent * fitted.x_mean);
  fit.slope_min = kInfinity;
  fit.slope_max = -fit.slope_min;
  double rest = 0.0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const auto& [x, y] = points[i];
    const double residual = y - fitted.y_mean - fit.exponent * (x - fitted.x_mean);
    rest += residual * residual;
    if (i == 0) continue;
    const double slope = (y - points[i - 1].second) / (x - points[i - 1].first);
    fit.slope_min = std::min(fit.slope_min, slope);
    fit.slope_max = std::max(fit.slope_max, slope);
  }
  const double n = static_cast<double>(points.size());
  fit.standard_error = points.size() > 2 ? std::sqrt(rest / (n - 2.0) / fitted.xx) : kNaN;
  return fit;
}

}  // namespace loopbench::harness
