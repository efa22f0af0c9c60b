// Reasons for warnings in the column "ok?" of a table: sentences that name rows.
#pragma once

#include <span>
#include <string>
#include <utility>
#include <vector>

#include "harness/record/record.h"

namespace loopbench::harness {

/// Returns the case keys in which rows differ. Absolute tolerances go with relative ones.
std::vector<std::string> DistinguishingKeys(std::span<const Record> rows);

/// Returns "odca/velocity/joint rtol 1e-08": texts unchanged, numbers with their key; the mechanism
/// if `row` has none of `keys`.
std::string NameOfRow(const Record& row, const std::vector<std::string>& keys);

/// Returns all warning codes with their meanings.
std::vector<std::pair<std::string, std::string>> MeaningsOfWarnings();

/// Returns a line per kind of warning among the rows, with its numbers. A line per problem whose
/// runs end differently names the runs that agree. Long lists are cut, with the number of omitted
/// items. `records` are all records of the store, including runs that the table omits.
std::vector<std::string> WarningNotes(std::span<const Record> rows,
                                      std::span<const Record> records);

}  // namespace loopbench::harness
