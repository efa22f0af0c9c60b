// Tables and documents of robustness maps and work-precision comparisons.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "harness/judge/robustness_map.h"
#include "harness/judge/work_precision.h"
#include "harness/tables/table.h"

namespace loopbench::harness {

// The robustness map as CSV and as text.

// Robustness map read from its CSV, for pictures: the original store is large and rarely kept.

/// Returns the map of these rules with the cells of robustness-map.csv (MapCellTable()). Each cell
/// has its state and requirement; numbers and reasons are not read.
///
/// @throws ConfigError with file, line and found text if the CSV is invalid or its cells differ
/// from the rules.
RobustnessMap MapFromCsv(const MapRules& rules, std::string_view csv, const std::string& file);

// Robustness map as tables for a terminal and for programs, and as a page.

/// Returns "3 of 877 cells that hold have runs with warnings".
std::string CountFlagged(const RobustnessMap& map);

/// Returns one row per stress test and one column per method (by letter, named in the notes),
/// coloured by state on a terminal: "ok 2.1e-09", "singular at 0.31 s 3/4", "?" for not measured,
/// "-" for not applicable.
Table MapTable(const RobustnessMap& map);

/// Returns one row per cell with all deciding data in full precision: robustness-map.csv.
Table MapCellTable(const RobustnessMap& map);

/// Returns robustness-map.md: a table per group, the limits with reasons, and every cell that does
/// not hold with number and message. `notes` (provenance) are at the end.
std::string MapMarkdown(const RobustnessMap& map, const std::vector<std::string>& notes);

// Work-precision comparison as tables for a terminal and for programs, and as a page.

/// Rows and width of a table.
struct WorkPrecisionView {
  bool compact = true;  ///< few columns and short words, for a terminal of about 100 columns
  bool all = false;     ///< all rows; otherwise only the front and rows not compared
};

/// Returns rows in order of cost, grouped by problem. Rows on the front have a '*', rows not
/// compared their reason. A compact table omits constant columns. In a full table, "error" and
/// "cost" are numbers of one key each, named in the notes.
Table WorkPrecisionTable(const WorkPrecision& work_precision, const WorkPrecisionView& view);

/// Returns one row per problem and error limit, one column per formulation: the cost of its
/// cheapest method, the ratio to the cheapest of all, or "none".
Table OverviewTable(const WorkPrecision& work_precision);

/// Returns one row per problem, error limit and formulation with the method, error and cost:
/// work-precision-overview.csv.
Table CheapestTable(const WorkPrecision& work_precision);

/// Returns work-precision.md: overview, fairness statement, the cheapest methods, and all rows of
/// all problems. `notes` (provenance) are at the end.
std::string WorkPrecisionMarkdown(const WorkPrecision& work_precision,
                                  const std::vector<std::string>& notes);

}  // namespace loopbench::harness
