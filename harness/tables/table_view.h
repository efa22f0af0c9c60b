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

// Factorial effects on drift: ratios between runs that differ in only one factor.

/// Options of the comparison. Tolerance and horizon affect drift most, so both are held fixed.
struct FactorialOptions {
  double rtol = 1e-8;
  double horizon = 10.0;  ///< [s]
  /// Problems that differ only in geometry: square (the closure is a linear invariant of the
  /// relative coordinates) and general. Other problems have no factor geometry, but all other
  /// factors.
  std::vector<std::pair<std::string, std::string>> square_and_general = {
      {"square-four-bar", "four-bar"}, {"square-seven-bar", "general-seven-bar"}};
};

/// Returns one row per change of one factor (formulation, coordinates, enforcement level, geometry)
/// and setting of the factor with most interaction. `within` is the geometry, for the factor
/// geometry itself the coordinates; "all" is every pair together.
///
/// Pairs are records equal, except for the factor, in mechanism, formulation, enforcement,
/// coordinates, solver, integrator and the parameters of a sweep. If also the case_id is equal, the
/// last record counts. The ratio is drift_position_max of `to` divided by drift_position_max of
/// `from`: geometric mean, smallest and largest. Drift below the unit round-off (2.2e-16 m) counts
/// as the unit round-off. exponent_difference is the mean of growth_exponent(to) -
/// growth_exponent(from) over the pairs that have both. Pairs with a failed run or a drift that is
/// not finite have no ratio: `left_out` counts them, and they keep their row.
///
/// @throws ConfigError if records equal in all of these are different cases.
Table FactorialTable(std::span<const Record> records, const FactorialOptions& options = {});

// Records of runs in several scalars (kind "precision"): ladders, their order, notes.

/// Keys, in addition to parameters, whose values are equal on all rungs of a ladder.
inline constexpr const char* kLadderKeys[] = {"mechanism",   "formulation", "enforcement",
                                              "coordinates", "solver",      "horizon",
                                              "experiment",  "config_hash"};

/// Returns a text that identifies the ladder of a record.
std::string LadderOf(const Record& record);

/// True for the rung with which the others are compared.
bool IsReferenceRung(const Record& record);

/// Sorts ladder by ladder, within it by tolerance from the largest, then by scalar from the
/// narrowest. The reference comes last.
void SortSweepLevels(std::vector<Record>* records);

/// Returns the meaning of error, drift and dominant error, one line each.
std::vector<std::string> PrecisionNotes();

// Selection and order of the rows and columns of a table.

struct TableView {
  /// "drift", "timing", "factorial", "all" (records of every kind), or "" for the first of drift,
  /// timing and all that has records in the store.
  std::string kind = "";
  bool compact = false;  ///< few columns and short words, for a terminal of about 100 columns
  Selection where = {};
  std::string group = "";                 ///< key whose values divide the table, "" for none
  std::vector<std::string> columns = {};  ///< keys in order; empty for the columns of the kind
  std::string sort = "";    ///< first key of the order, before the usual order (SortRows)
  bool descending = false;  ///< largest first; missing values stay last
};

/// Returns the table of a view, without provenance. If no row matches, the table has no rows. Keys
/// of the records that no table has (parameters of a sweep) are added, unless columns were chosen.
///
/// @throws ConfigError if `where`, `group`, `columns` or `sort` name a key that no record has.
Table MakeTable(std::span<const Record> records, const TableView& view);

/// Returns the kind that the view shows for these records: its own, else the first with records.
std::string KindOf(const TableView& view, std::span<const Record> records);

/// Returns the rows of the table before `sort` and `group`: records of its kind that match.
std::vector<Record> RowsOf(std::span<const Record> records, const TableView& view);

/// Returns notes ("warning: ...") if timings among the rows come from a noisy machine: their
/// number, the worst A/A spread, load and governor (thresholds: harness/record/noise.h). No notes
/// if all were quiet.
std::vector<std::string> NoiseWarnings(std::span<const Record> rows);

}  // namespace loopbench::harness
