// Which factor is drift due to? Ratios between runs that differ in one factor alone.
#pragma once

#include <span>
#include <string>
#include <utility>
#include <vector>

#include "harness/record/record.h"
#include "harness/tables/table.h"

namespace loopbench::harness {

/// What is compared. Drift depends on tolerance and horizon most of all, so both are held fixed.
struct FactorialOptions {
  double rtol = 1e-8;
  double horizon = 10.0;  ///< [s]
  /// Scenes that differ in geometry alone: square (the closure is a linear invariant of the
  /// relative coordinates) and general. Other scenes take no part in the factor geometry, but in
  /// the others.
  std::vector<std::pair<std::string, std::string>> square_and_general = {
      {"square-four-bar", "four-bar"}, {"square-seven-bar", "general-seven-bar"}};
};

/// One row per change of one factor (formulation, coordinates, level of enforcement, geometry) and
/// per setting of the factor it interacts with most: `within` is the geometry, for the factor
/// geometry itself the coordinates, and "all" is every pair together.
///
/// Pairs are records equal in mechanism, formulation, enforcement, coordinates, solver and
/// integrator and in the parameters of a sweep, except for the factor. Of records equal in all of
/// these and in case_id the last one counts. The ratio is
/// drift_position_max of `to` over that of `from`, given as geometric mean, least and largest;
/// drift below the unit of round-off (2.2e-16 m) counts as that. exponent_difference is the mean of
/// growth_exponent(to) - growth_exponent(from) over the pairs that have both. Pairs with a run that
/// failed, or whose drift is not finite, have no ratio: they are counted in `left_out` and keep
/// their row.
///
/// @throws ConfigError for records equal in all of these that are different cases.
Table FactorialTable(std::span<const Record> records, const FactorialOptions& options = {});

}  // namespace loopbench::harness
