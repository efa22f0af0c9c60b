// Detection of level changes in a series of numbers, robust to outliers.
//
// P. Fearnhead, G. Rigaill, "Changepoint detection in the presence of outliers", Journal of the
// American Statistical Association 114 (2019) 169-183: minimal penalised cost with the biweight
// loss min((x - mu)^2, K^2), computed exactly by functional pruning (R-FPOP, a variant of PELT for
// bounded losses). An isolated outlier costs at most K^2 and thus causes no change.
#pragma once

#include <algorithm>
#include <cstddef>
#include <span>
#include <vector>

namespace loopbench::harness {

/// Returns the first indices of all segments except the first, ascending.
/// @param x  finite values
/// @param bound  K > 0: values farther from their level are outliers
/// @param penalty  per change, in the unit of the cost: x squared
std::vector<std::size_t> RobustSegments(std::span<const double> x, double bound, double penalty);

/// Noise of a series between its changes: an autoregressive process of order 1.
struct Noise {
  double sigma = 0.0;        ///< standard deviation about its level
  double correlation = 0.0;  ///< correlation of neighbours, 0 to 0.9: slow phases of a machine last

  /// Returns the long-run standard deviation: means vary as for independent values with it.
  double LongRun() const;
};

/// Estimates noise from the mean squares of x[i+k] - x[i] for k = 1, 2, 3. Differences above 3.5
/// times the median-implied value of normal noise come from steps and outliers and are ignored, at
/// most a quarter. The growth with k gives the correlation, reduced by n^2 / (n^2 + 15^2) because
/// few values may imitate any. Similar estimates: G. Romano, G. Rigaill, V. Runge, P. Fearnhead,
/// "Detecting abrupt changes in the presence of local fluctuations and autocorrelated noise",
/// Journal of the American Statistical Association 117 (2022) 2147-2162. Returns no noise below
/// four values.
Noise NoiseOf(std::span<const double> x);

/// A change of level in a series of logarithms: a ratio.
struct LevelChange {
  std::size_t at = 0;                ///< first value of the new level
  double before = 0.0, after = 0.0;  ///< medians of the segments
  /// Expected number of changes at least as clear by noise alone, at all tested positions together.
  double expected = 0.0;

  double Confidence() const { return std::max(0.0, 1.0 - expected); }
};

/// Prior knowledge about a series.
struct Resolution {
  double noise = 0.0;   ///< minimum standard deviation that is assumed
  double least = 0.0;   ///< smaller changes are ignored
  double places = 0.0;  ///< number of tested positions: values of this series and all others
};

/// Maximum accepted number of changes by noise alone, at all tested positions together.
inline constexpr double kFalseAlarms = 0.01;

/// Finds the changes of a series. Candidates come from RobustSegments() with bound 3 sigma (as by
/// the authors) and the usual penalty, 2 log(n) times the long-run variance. The least certain
/// candidate is removed repeatedly, until all changes are at least resolution.least and noise is
/// expected to cause at most kFalseAlarms at all tested positions (Bonferroni). The probabilities
/// of two causes are added:
///   - Segment means differ by noise: normal tail for their standard error. It uses the long-run
///     standard deviation plus two of its own standard errors.
///   - The shorter segment consists of outliers of its neighbour: binomial tail for the number of
///     values beyond half of the step, with the share beyond 3 sigma in the series.
std::vector<LevelChange> FindChanges(std::span<const double> x, const Resolution& resolution);

}  // namespace loopbench::harness
