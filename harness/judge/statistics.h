// Whether one sample of times is larger than another, and how many such questions may be asked.
#pragma once

#include <span>
#include <vector>

namespace loopbench::harness {

/// Median; NaN of nothing, and of a sample with a NaN in it.
double Median(std::span<const double> sample);

/// Mann-Whitney test of two independent samples.
struct MannWhitneyResult {
  double u = 0.0;        ///< pairs (a, b) with a > b; equal ones count a half
  double p_greater = 1;  ///< probability of such a u or a larger one if neither sample is larger
  bool exact = false;    ///< p from the exact distribution, else from the normal approximation
};

/// H1: values of `a` tend to be larger than those of `b` (H. B. Mann, D. R. Whitney, 1947). Exact
/// without ties and up to 40 values in a sample; otherwise normal with corrections for ties and
/// continuity. p = 1 when a sample is empty. The samples are finite numbers.
MannWhitneyResult MannWhitney(std::span<const double> a, std::span<const double> b);

/// The smallest p_greater that samples of these sizes can give.
double SmallestP(std::size_t a, std::size_t b);

/// p-values adjusted by Holm's step-down method (S. Holm, 1979), in the order given: rejecting
/// those at most alpha keeps the probability of any false rejection below alpha, whatever the
/// dependence.
std::vector<double> HolmAdjusted(std::span<const double> p);

}  // namespace loopbench::harness
