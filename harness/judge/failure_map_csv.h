// A failure map read back from its CSV, for pictures: the store that it was made of is large, and
// seldom kept.
#pragma once

#include <string>
#include <string_view>

#include "harness/judge/failure_map.h"

namespace loopbench::harness {

/// The map of these rules with the cells of failure-map.csv (MapCellTable()): of each its state and
/// whether it must hold; numbers and reasons stay in the file.
///
/// @throws ConfigError with file, line and what was found, where the text is no such CSV, or has
/// other cells than the rules.
FailureMap MapFromCsv(const MapRules& rules, std::string_view csv, const std::string& file);

}  // namespace loopbench::harness
