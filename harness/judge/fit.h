// Exponents of time over size, from benchmarks and from the timings of a store.
#pragma once

#include <string>
#include <vector>

#include "harness/record/record.h"

namespace loopbench::harness {

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
