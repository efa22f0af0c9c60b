// Tables of records: factorial effects, runs in several scalars, any columns.
#pragma once

#include <span>
#include <string>
#include <utility>
#include <vector>

#include "harness/record/record.h"
#include "harness/record/select.h"
#include "harness/tables/table.h"

namespace loopbench::harness {

// Which factor is drift due to? Ratios between runs that differ in one factor alone.

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

// Records of runs in several scalars (kind "precision"): which form a ladder, their order, notes.

/// The keys, besides parameters, whose values rungs of one ladder share.
inline constexpr const char* kLadderKeys[] = {"mechanism",   "formulation", "enforcement",
                                              "coordinates", "solver",      "horizon",
                                              "experiment",  "config_hash"};

/// One text per ladder.
std::string LadderOf(const Record& record);

/// Whether a rung is the one that the others are compared with.
bool IsReferenceRung(const Record& record);

/// One ladder after another; in each the tolerances from the largest, and for each the scalars from
/// the narrowest. The reference comes last.
void SortRungs(std::vector<Record>* records);

/// What error, drift and "ruled by" mean, one line each.
std::vector<std::string> PrecisionNotes();

// Which rows and columns of a store a table shows, and in which order.

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
