// Exponents of time over size, from the records of benchmarks.
#pragma once

#include <string>
#include <vector>

#include "harness/record/record.h"

namespace loopbench::harness {

/// One row per family of benchmarks, that is names equal but for one part that is a number
/// ("rhs/chain/10/odca/..." and "rhs/chain/30/odca/..."). Sizes are bodies (counter "bodies"), or
/// that number where there is no such counter. Keys: "family", "sizes", "bodies_min", "bodies_max",
/// "exponent", "standard_error", "slope_min", "slope_max", "ns_per_body" at the largest size,
/// "failed" (benchmarks of the family that ended in an error, of any size). Benchmarks without such
/// a part and families of a single benchmark are left out; families of which fewer than two sizes
/// could be measured have no exponent. Sizes below `from` do not count.
std::vector<Record> FitFamilies(const std::vector<Record>& benchmarks, double from);

}  // namespace loopbench::harness
