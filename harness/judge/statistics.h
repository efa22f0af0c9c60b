// Statistics of samples, and fitted exponents.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "harness/record/record.h"

namespace loopbench::harness {

// Test whether one sample of times is larger than another, and correction for multiple tests.

/// Returns the median; NaN for an empty sample or a sample with NaN.
double Median(std::span<const double> sample);

/// Result of the Mann-Whitney test of two independent samples.
struct MannWhitneyResult {
  double u = 0.0;        ///< number of pairs (a, b) with a > b; equal pairs count one half
  double p_greater = 1;  ///< probability of at least this u under equal distributions
  bool exact = false;    ///< p from the exact distribution, otherwise normal approximation
};

/// H1: values of `a` tend to be larger than those of `b` (H. B. Mann, D. R. Whitney, 1947). Exact
/// without ties and up to 40 values in a sample; otherwise normal with corrections for ties and
/// continuity. p = 1 when a sample is empty. The samples are finite numbers.
MannWhitneyResult MannWhitney(std::span<const double> a, std::span<const double> b);

/// Returns the smallest possible p_greater for these sample sizes.
double SmallestP(std::size_t a, std::size_t b);

/// Returns p-values adjusted by Holm's step-down method (S. Holm, 1979), in the given order.
/// Rejecting values up to alpha keeps the probability of any false rejection below alpha, for any
/// dependence.
std::vector<double> HolmAdjusted(std::span<const double> p);

// Exponents of time over size, from benchmarks and from the timings of a store.

/// Returns one row per family of right-hand sides: benchmarks with names equal except one numeric
/// part ("rhs/chain/10/odca/..." and "rhs/chain/30/odca/..."), or timings of equal methods with
/// mechanisms "chain-10" and "chain-30". Sizes are numbers of bodies (counter "bodies"), or the
/// numeric part without this counter. Keys: "family", "sizes", "bodies_min", "bodies_max",
/// "exponent", "standard_error", "slope_min", "slope_max", "ns_per_body" at the largest size,
/// "failed" (members of the family that ended with an error, of any size). Names without a numeric
/// part and families with one member are left out; families with fewer than two measured sizes have
/// no exponent. Sizes below `from` are ignored.
std::vector<Record> FitFamilies(const std::vector<Record>& measured, double from);

}  // namespace loopbench::harness
