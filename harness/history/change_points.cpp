#include <cmath>
#include <limits>
#include <numbers>

#include "harness/history/history.h"
#include "harness/judge/judge.h"

namespace loopbench::harness {
namespace {

/// Cost a (mu - middle)^2 + c on [from, to]: the minimum over all segmentations with last level mu,
/// and the start of their last segment. The centred form avoids the cancellation of powers of mu,
/// which would lose a step of 1 in 1e6 next to a step of 1000.
struct CostPiece {
  double from, to, a, middle, c;
  std::size_t begin;

  double At(double mu) const { return a * (mu - middle) * (mu - middle) + c; }
  double Lowest() const {
    return a > 0.0 ? std::clamp(middle, from, to) : from;  // a == 0: constant
  }
};

/// Appends the minimum of the piece and the constant `level`, which represents a segment beginning
/// at `begin`. Adjacent constants with equal `begin` are joined.
void AddCapped(const CostPiece& piece, double level, std::size_t begin,
               std::vector<CostPiece>* pieces) {
  const auto add = [pieces](const CostPiece& one) {
    if (!(one.to > one.from)) return;
    const bool joins = !pieces->empty() && pieces->back().a == 0.0 && one.a == 0.0 &&
                       pieces->back().begin == one.begin && pieces->back().c == one.c;
    if (joins) {
      pieces->back().to = one.to;
    } else {
      pieces->push_back(one);
    }
  };
  const auto constant = [&](double from, double to) {
    return CostPiece{from, to, 0.0, 0.0, level, begin};
  };
  if (piece.a == 0.0) {
    add(piece.c <= level ? piece : constant(piece.from, piece.to));
    return;
  }
  // piece <= level between the roots
  const double depth = (level - piece.c) / piece.a;
  if (depth <= 0.0) {
    add(constant(piece.from, piece.to));
    return;
  }
  const double left = std::clamp(piece.middle - std::sqrt(depth), piece.from, piece.to);
  const double right = std::clamp(piece.middle + std::sqrt(depth), piece.from, piece.to);
  add(constant(piece.from, left));
  add({left, right, piece.a, piece.middle, piece.c, piece.begin});
  add(constant(right, piece.to));
}

/// Adds min((x - mu)^2, bound^2) to the piece.
void AddLoss(const CostPiece& piece, double x, double bound, std::vector<CostPiece>* pieces) {
  const double left = std::clamp(x - bound, piece.from, piece.to);
  const double right = std::clamp(x + bound, piece.from, piece.to);
  const auto add = [pieces](const CostPiece& one) {
    if (one.to > one.from) pieces->push_back(one);
  };
  const double a = piece.a + 1.0, off = x - piece.middle;
  add({piece.from, left, piece.a, piece.middle, piece.c + bound * bound, piece.begin});
  add({left, right, a, piece.middle + off / a, piece.c + piece.a / a * off * off, piece.begin});
  add({right, piece.to, piece.a, piece.middle, piece.c + bound * bound, piece.begin});
}

/// Outliers are few: if they seem to cause more than a quarter of the differences, the differences
/// are typical, for instance for a machine with two speeds.
constexpr double kFewest = 0.75;

/// Returns the mean square of x[i+lag] - x[i] without steps and outliers, found from the median.
double VarianceOfDifferences(std::span<const double> x, std::size_t lag) {
  std::vector<double> differences;
  for (std::size_t i = lag; i < x.size(); ++i) differences.push_back(std::abs(x[i] - x[i - lag]));
  // normal variable: median of |.| is 0.6745 standard deviations; one in 2000 is above 3.5
  const double most = 3.5 * Median(differences) / 0.6745;
  double sum = 0.0, all = 0.0, count = 0.0;
  for (const double one : differences) {
    all += one * one;
    if (one > most) continue;
    sum += one * one;
    count += 1.0;
  }
  const auto n = static_cast<double>(differences.size());
  return count < kFewest * n ? all / n : sum / count;
}

/// Returns the probability that at least `least` of n values are outliers.
double AreOutliers(std::size_t n, std::size_t least, double share) {
  if (share >= 1.0) return 1.0;
  double sum = 0.0;
  for (std::size_t k = least; k <= n; ++k) {
    const auto all = static_cast<double>(n), some = static_cast<double>(k);
    sum +=
        std::exp(std::lgamma(all + 1.0) - std::lgamma(some + 1.0) - std::lgamma(all - some + 1.0) +
                 some * std::log(share) + (all - some) * std::log1p(-share));
  }
  return std::min(1.0, sum);
}

/// Segments of a series and the certainty of the changes between them.
class Segments {
 public:
  Segments(std::span<const double> x, const Resolution& resolution)
      : x_(x), resolution_(resolution) {
    const Noise noise = NoiseOf(x);
    const auto n = static_cast<double>(x.size());
    const double sigma = std::max(noise.sigma, resolution.noise);
    const double long_run = std::max(noise.LongRun(), resolution.noise);
    bound_ = 3.0 * sigma;
    edges_ = RobustSegments(x, bound_, 2.0 * long_run * long_run * std::log(n));
    edges_.insert(edges_.begin(), 0);
    edges_.push_back(x.size());
    // standard error of the root mean square of n neighbour differences: 0.87 / sqrt(n) of itself
    noise_ = noise.sigma == 0.0 ? 0.0 : long_run * (1.0 + 2.0 * 0.87 / std::sqrt(n));
  }

  std::vector<LevelChange> Sure() {
    for (;;) {
      std::vector<LevelChange> changes;
      std::size_t worst = 0;
      double most = 0.0;
      for (std::size_t i = 1; i + 1 < edges_.size(); ++i) {
        changes.push_back(ChangeAt(i));
        const LevelChange& change = changes.back();
        const bool is_small = std::abs(change.after - change.before) < resolution_.least;
        const double expected =
            is_small ? std::numeric_limits<double>::infinity() : change.expected;
        if (expected > most) {
          most = expected;
          worst = i;
        }
      }
      if (most <= kFalseAlarms) return changes;
      edges_.erase(edges_.begin() + static_cast<std::ptrdiff_t>(worst));
    }
  }

 private:
  struct Level {
    double median = 0.0, mean = 0.0;  ///< mean: without outliers
  };
  Level LevelOf(std::size_t segment) const {
    const std::size_t from = edges_[segment], to = edges_[segment + 1];
    Level level{Median(x_.subspan(from, to - from))};
    for (std::size_t i = from; i < to; ++i) {
      level.mean += std::clamp(x_[i] - level.median, -bound_, bound_);
    }
    level.mean = level.median + level.mean / static_cast<double>(to - from);
    return level;
  }

  std::size_t SizeOf(std::size_t segment) const { return edges_[segment + 1] - edges_[segment]; }

  /// Counts values of a segment farther from a level than `far`, on the side of its sign.
  std::size_t Beyond(std::size_t segment, double level, double far) const {
    return static_cast<std::size_t>(std::ranges::count_if(
        x_.subspan(edges_[segment], SizeOf(segment)),
        [=](double value) { return (value - level) * std::copysign(1.0, far) > std::abs(far); }));
  }

  /// Returns the probability that the values of segment `fewer` are outliers of `level`, the level
  /// of its neighbour. It counts values beyond half of the step, at least half of the values, since
  /// they determine the median. The outlier share is the share in the series beyond the bound, with
  /// one more than observed.
  double AreOutliersOf(double level, std::size_t fewer) const {
    const double step = LevelOf(fewer).median - level;
    const double far = std::copysign(std::max(bound_, 0.5 * std::abs(step)), step);
    std::size_t outliers = 1;
    for (std::size_t segment = 0; segment + 1 < edges_.size(); ++segment) {
      const double median = LevelOf(segment).median;
      outliers += Beyond(segment, median, bound_) + Beyond(segment, median, -bound_);
    }
    const std::size_t n = SizeOf(fewer);
    const std::size_t half = (n + 1) / 2;
    // several outliers come in bursts: more of them are as likely as half
    const std::size_t least = outliers > 2 ? half : std::max(half, Beyond(fewer, level, far));
    return AreOutliers(n, least, static_cast<double>(outliers) / static_cast<double>(x_.size()));
  }

  /// Returns a change with its expected number by noise: from differing means, or from outliers.
  LevelChange ChangeAt(std::size_t i) const {
    const Level before = LevelOf(i - 1), after = LevelOf(i);
    LevelChange change{edges_[i], before.median, after.median};
    if (noise_ == 0.0) return change;
    const auto n = static_cast<double>(SizeOf(i - 1)), m = static_cast<double>(SizeOf(i));
    const double error = noise_ * std::sqrt(1.0 / n + 1.0 / m);
    const double by_outliers =
        m <= n ? AreOutliersOf(before.median, i) : AreOutliersOf(after.median, i - 1);
    change.expected =
        resolution_.places *
        (std::erfc(std::abs(after.mean - before.mean) / error / std::numbers::sqrt2) + by_outliers);
    return change;
  }

  std::span<const double> x_;
  Resolution resolution_;
  std::vector<std::size_t> edges_;
  double bound_ = 0.0, noise_ = 0.0;
};

}  // namespace

std::vector<std::size_t> RobustSegments(std::span<const double> x, double bound, double penalty) {
  if (x.size() < 2) return {};
  const auto [least, most] = std::ranges::minmax(x);
  // slightly wider than the range of values, so that equal values have an interval too
  const double margin = std::max(bound, 1e-12 * std::max(std::abs(least), std::abs(most)));
  // keeps the digits of differences of values near 0
  const double shift = 0.5 * (least + most);
  std::vector<CostPiece> costs = {
      {least - shift - margin, most - shift + margin, 0.0, 0.0, 0.0, 0}};
  std::vector<std::size_t> begins(x.size());
  double best = 0.0;
  for (std::size_t t = 0; t < x.size(); ++t) {
    std::vector<CostPiece> next;
    if (t > 0) {
      std::vector<CostPiece> capped;
      for (const CostPiece& piece : costs) AddCapped(piece, best + penalty, t, &capped);
      costs.swap(capped);
    }
    for (const CostPiece& piece : costs) AddLoss(piece, x[t] - shift, bound, &next);
    costs.swap(next);
    best = std::numeric_limits<double>::infinity();
    for (const CostPiece& piece : costs) {
      const double lowest = piece.At(piece.Lowest());
      if (lowest >= best) continue;
      best = lowest;
      begins[t] = piece.begin;
    }
  }
  std::vector<std::size_t> changes;
  for (std::size_t begin = begins.back(); begin > 0; begin = begins[begin - 1]) {
    changes.push_back(begin);
  }
  std::ranges::reverse(changes);
  return changes;
}

double Noise::LongRun() const {
  return sigma * std::sqrt((1.0 + correlation) / (1.0 - correlation));
}

Noise NoiseOf(std::span<const double> x) {
  if (x.size() < 4) return {};
  double variances[3];  // variance of differences over lag k: 2 sigma^2 (1 - correlation^k)
  for (std::size_t lag = 1; lag <= 3; ++lag) variances[lag - 1] = VarianceOfDifferences(x, lag);
  if (variances[0] == 0.0) return {};
  const double two = variances[1] / variances[0] - 1.0;    // the correlation r
  const double three = variances[2] / variances[0] - 1.0;  // r + r^2
  const double mean = 0.5 * (two + 0.5 * (std::sqrt(std::max(0.0, 1.0 + 4.0 * three)) - 1.0));
  const auto n = static_cast<double>(x.size());
  constexpr double kPrior = 15.0;
  const double correlation = std::clamp(mean, 0.0, 0.9) * n * n / (n * n + kPrior * kPrior);
  return {std::sqrt(variances[0] / (2.0 * (1.0 - correlation))), correlation};
}

std::vector<LevelChange> FindChanges(std::span<const double> x, const Resolution& resolution) {
  if (x.size() < 2) return {};
  return Segments(x, resolution).Sure();
}

}  // namespace loopbench::harness
