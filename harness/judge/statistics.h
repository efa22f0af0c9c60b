// Statistics of samples, and fitted exponents.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "harness/record/record.h"

namespace loopbench::harness {

// Whether one sample of times is larger than another, and how many such questions may be asked.

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

// Exponents of time over size, from benchmarks and from the timings of a store.

/// One row per family of right-hand sides, that is benchmarks with names equal but for one part
/// that is a number ("rhs/chain/10/odca/..." and "rhs/chain/30/odca/..."), or timings of equal
/// columns with mechanisms "chain-10" and "chain-30". Sizes are bodies (counter "bodies"), or that
/// number where there is no such counter. Keys: "family", "sizes", "bodies_min", "bodies_max",
/// "exponent", "standard_error", "slope_min", "slope_max", "ns_per_body" at the largest size,
/// "failed" (members of the family that ended in an error, of any size). What has no such
/// part and families of a single member are left out; families of which fewer than two sizes
/// could be measured have no exponent. Sizes below `from` do not count.
std::vector<Record> FitFamilies(const std::vector<Record>& measured, double from);

}  // namespace loopbench::harness
