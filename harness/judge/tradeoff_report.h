// What accuracy costs, as tables: for a terminal, for programs, and as a page.
#pragma once

#include <string>
#include <vector>

#include "harness/judge/tradeoff.h"
#include "harness/tables/table.h"

namespace loopbench::harness {

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
