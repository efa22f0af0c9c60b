// Where a series of numbers changes its level, whatever single values do.
//
// P. Fearnhead, G. Rigaill, "Changepoint detection in the presence of outliers", Journal of the
// American Statistical Association 114 (2019) 169-183: the least penalised cost with the biweight
// loss min((x - mu)^2, K^2), found exactly by functional pruning (their R-FPOP, the relative of
// PELT whose loss may be bounded). A value that is off by itself costs K^2 and no more, so that it
// makes no change.
#pragma once

#include <algorithm>
#include <cstddef>
#include <span>
#include <vector>

namespace loopbench::harness {

/// First values of the segments behind the first one, ascending.
/// @param x  finite
/// @param bound  K > 0: a value further from its level is an outlier
/// @param penalty  of each change, in the unit of the cost: that of x squared
std::vector<std::size_t> RobustSegments(std::span<const double> x, double bound, double penalty);

/// What a series does between its changes, as an autoregressive process of order 1.
struct Noise {
  double sigma = 0.0;        ///< standard deviation about its level
  double correlation = 0.0;  ///< of neighbours, 0 to 0.9: a slow hour of a machine lasts

  /// Of means: n of them vary as if they were independent with this standard deviation.
  double LongRun() const;
};

/// From the mean squares of x[i+k] - x[i] for k = 1, 2, 3, without the few that steps and outliers
/// make: a quarter at most, above 3.5 times the value that the median implies for normal noise.
/// Their growth with k gives the correlation, which is reduced by n^2 / (n^2 + 15^2): a few values
/// may seem to have any. Such estimates: G. Romano, G. Rigaill, V. Runge, P. Fearnhead, "Detecting
/// abrupt changes in the presence of local fluctuations and autocorrelated noise", Journal of the
/// American Statistical Association 117 (2022) 2147-2162. Nothing below four values.
Noise NoiseOf(std::span<const double> x);

/// A change of level, in a series of logarithms: a ratio.
struct LevelChange {
  std::size_t at = 0;                ///< first value of the new level
  double before = 0.0, after = 0.0;  ///< medians of the segments
  /// At least as many such changes as this noise alone is expected to show, at all places together.
  double expected = 0.0;

  double Confidence() const { return std::max(0.0, 1.0 - expected); }
};

/// What may be known of a series before it is looked at.
struct Resolution {
  double noise = 0.0;   ///< least standard deviation that is assumed
  double least = 0.0;   ///< smaller changes are none
  double places = 0.0;  ///< at which changes are looked for: values, in this series and all others
};

/// The most changes by noise alone that are accepted, at all places together.
inline constexpr double kFalseAlarms = 0.01;

/// The changes of a series. Candidates come from RobustSegments() with bound 3 sigma (the authors')
/// and penalty 2 log(n) times the long-run variance, the usual one. The least sure candidate is
/// removed until all are at least resolution.least, and noise is expected to make at most
/// kFalseAlarms of them at all places together (Bonferroni). Noise makes a change in two ways,
/// whose probabilities are added:
///   - The means of the segments on both sides differ: the normal tail of their standard error,
///   from
///     the long-run standard deviation, taken two of its own standard errors larger than estimated.
///   - The values of the shorter segment are outliers of its neighbour: the binomial tail of as
///   many
///     values as lie beyond half of the step, with the share beyond 3 sigma in the series.
std::vector<LevelChange> FindChanges(std::span<const double> x, const Resolution& resolution);

}  // namespace loopbench::harness
