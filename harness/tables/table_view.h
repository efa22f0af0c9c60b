// Which rows and columns of a store a table shows, and in which order.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "harness/record/record.h"
#include "harness/record/select.h"
#include "harness/tables/table.h"

namespace loopbench::harness {

struct TableView {
  /// "drift", "timing", "factorial", "all" (records of every kind), or "" for drift, timing or all,
  /// the first that the store has records of.
  std::string kind = "";
  bool compact = false;  ///< few columns and short words, for a terminal of some 100 columns
  Selection where = {};
  std::string group = "";                 ///< key whose values divide the table, "" for none
  std::vector<std::string> columns = {};  ///< keys in order; empty for those of the kind
  std::string sort = "";                  ///< key, before the usual order (SortRows)
  bool descending = false;                ///< largest first; what is missing stays last
};

/// The table of a view, without provenance. Rows without a match leave a table without rows. Keys
/// that no table knows but the records have (the parameters of a sweep) are shown too, unless
/// columns were chosen.
///
/// @throws ConfigError when `where`, `group`, `columns` or `sort` name a key that no record has.
Table MakeTable(std::span<const Record> records, const TableView& view);

/// The kind that the view shows of a store that has these records: its own, else the first.
std::string KindOf(const TableView& view, std::span<const Record> records);

/// The rows of such a table, in its order before `sort` and `group`: those of its kind that match.
std::vector<Record> RowsOf(std::span<const Record> records, const TableView& view);

/// Notes ("warning: ...") when timings among the rows come from a noisy machine: how many, the
/// worst A/A spread, load and governor (harness/record/noise.h has the thresholds). None when all
/// were quiet.
std::vector<std::string> NoiseWarnings(std::span<const Record> rows);

}  // namespace loopbench::harness
