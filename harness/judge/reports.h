// The robustness map, and work and precision, as tables and documents.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "harness/judge/failure_map.h"
#include "harness/judge/tradeoff.h"
#include "harness/tables/table.h"

namespace loopbench::harness {

// The robustness map as CSV and as text.

// A robustness map read back from its CSV, for pictures: the store that it was made of is large,
// and seldom kept.

/// The map of these rules with the cells of robustness-map.csv (MapCellTable()): of each its state
/// and whether it must hold; numbers and reasons stay in the file.
///
/// @throws ConfigError with file, line and what was found, where the text is no such CSV, or has
/// other cells than the rules.
FailureMap MapFromCsv(const MapRules& rules, std::string_view csv, const std::string& file);

// The robustness map as tables: for a terminal, for programs, and as a page.

/// "24 cells: 15 holds, 3 stopped, 1 inaccurate, 5 not measured".
std::string CountCells(const FailureMap& map);
/// "3 of 877 cells that hold have runs in doubt".
std::string CountDoubts(const FailureMap& map);

/// One row per extreme, one column per method (by letter, named in the notes), coloured by state on
/// a terminal: "ok 2.1e-09", "singular at 0.31 s 3/4", "?" for what was not measured, "-" for what
/// is not applicable.
Table MapTable(const FailureMap& map);

/// One row per cell with all that decided it, every digit: robustness-map.csv.
Table MapCellTable(const FailureMap& map);

/// robustness-map.md: a table per group, the limits with their reasons, and every cell that does
/// not hold with its number and message. `notes` (provenance) at the end.
std::string MapMarkdown(const FailureMap& map, const std::vector<std::string>& notes);

// What accuracy costs, as tables: for a terminal, for programs, and as a page.

/// Which rows a table shows, and how wide it may be.
struct TradeoffView {
  bool compact = true;  ///< few columns and short words, for a terminal of some 100 columns
  bool all = false;     ///< every row; else those on the front and those that are not compared
};

/// One table per problem: rows in order of cost, those on the front with a '*', those that are not
/// compared with their reason. Columns in which no row differs are left out of a compact table. In
/// full, "error" and "cost" are numbers of one key each, which the notes name.
Table TradeoffTable(const Tradeoff& tradeoff, const TradeoffView& view);

/// Per problem and class of errors a row, per formulation a column: what its cheapest method costs,
/// how many times the cheapest of all, and "none reached it" where none did.
Table OverviewTable(const Tradeoff& tradeoff);

/// The same, a row per problem, class and formulation with the method, its error and cost:
/// tradeoff-overview.csv.
Table CheapestTable(const Tradeoff& tradeoff);

/// tradeoff.md: overview, fairness statement, the cheapest methods, and all rows of all problems.
/// `notes` (provenance) at the end.
std::string TradeoffMarkdown(const Tradeoff& tradeoff, const std::vector<std::string>& notes);

}  // namespace loopbench::harness
