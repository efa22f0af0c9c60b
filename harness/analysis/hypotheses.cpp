#include "harness/analysis/hypotheses.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace loopbench::harness {
namespace {

constexpr std::array<double, 4> kExponents = {0.5, 1.0, 1.5, 2.0};
constexpr std::array<const char*, 5> kNames = {"t^0.5", "t^1", "t^1.5", "t^2", "exponential"};
constexpr std::size_t kExponential = kExponents.size();
constexpr std::size_t kHypotheses = kNames.size();

// Residuals below this are a perfect fit; their logarithm would be minus infinity.
constexpr double kLeastMeanSquare = 1e-20;

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
  const auto log_of = [](double square) { return std::log(std::max(square, kLeastMeanSquare)); };
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
  std::vector<double> values;
  for (const Scores& member : members) values.push_back(get(member));
  return values;
}

// Whether the values are positive on average, by so many standard errors.
bool IsPositive(const std::vector<double>& values, double standard_errors) {
  const double mean = Mean(values), count = static_cast<double>(values.size());
  double squares = 0;
  for (const double value : values) squares += (value - mean) * (value - mean);
  return mean > standard_errors * std::sqrt(squares / (count - 1) / count);
}

// Whether the winner describes the data at all.
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
  constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
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

}  // namespace loopbench::harness
