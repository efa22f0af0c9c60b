// Robustness map of methods and stress tests: rules, their file, cells.
#pragma once

#include <array>
#include <cstddef>
#include <filesystem>
#include <limits>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "harness/judge/demand.h"
#include "harness/record/record.h"
#include "harness/record/select.h"

namespace loopbench::harness {

// Robustness map: methods and stress tests, each cell evaluated from records by rules.
//
// A rules file (configs/experiments/extremes/map.json) contains methods (columns), stress tests
// (rows) and for each row the deciding measures. A cell's class and deciding number depend on the
// records only and are never written by hand.

/// Stress test: a row of the map.
struct MapRow {
  std::string label;
  Selection select;             ///< selection of records, with the column's selection
  std::vector<Demand> decides;  ///< demands that must all be met
  std::vector<std::string> right = {"finished"};      ///< expected outcomes of a run
  std::vector<bool> must_hold;                        ///< by column: true if required by the gate
  std::map<std::string, std::string> not_applicable;  ///< reason by column label
  std::string others_not_applicable;  ///< reason for all other columns not required, or ""
  std::size_t cases = 1;              ///< minimum number of records to hold
  std::string why;                    ///< origin of the limits
};

struct MapGroup {
  std::string label;
  std::string short_label;  ///< for pictures, or ""
  std::vector<MapRow> rows;
};

/// Method: a column of the map.
struct MapMethod {
  std::string label;
  Selection select;
};

struct MapRules {
  std::string title, comment;
  std::vector<MapMethod> columns;
  std::vector<MapGroup> groups;
};

/// State of a cell, from good to bad; the worst of several records decides. A wrong result without
/// an error is worse than a run that stops with a reason or does not end.
enum class CellState {
  kHolds,          ///< expected outcome, all demands met
  kNotApplicable,  ///< no record, and the rules contain a reason
  kNotMeasured,    ///< too few records, or a record without a deciding measure
  kStopped,        ///< ended early with a numerical reason: singular, locked, ...
  kLimit,          ///< stopped by a limit: step-limit, time-limit, ...
  kInaccurate,     ///< ended normally, but a demand is not met
  kBroken,         ///< crashed, or returned an invalid result
};
inline constexpr std::array kCellStates = {CellState::kHolds,        CellState::kStopped,
                                           CellState::kLimit,        CellState::kInaccurate,
                                           CellState::kBroken,       CellState::kNotMeasured,
                                           CellState::kNotApplicable};  ///< in the order of legends

/// "holds", "stopped", "limit", "inaccurate", "broken", "not measured", "not applicable".
std::string_view ToString(CellState state);

/// Outcomes that rules may name, and the state of a run with this outcome if it is not expected.
struct RunEnding {
  std::string_view word;
  CellState state;
};
inline constexpr std::array kRunEndings = {RunEnding{"finished", CellState::kInaccurate},
                                           RunEnding{"singular", CellState::kStopped},
                                           RunEnding{"step-too-small", CellState::kStopped},
                                           RunEnding{"non-finite", CellState::kStopped},
                                           RunEnding{"inconsistent-start", CellState::kStopped},
                                           RunEnding{"inconsistent-motion", CellState::kStopped},
                                           RunEnding{"locked", CellState::kStopped},
                                           RunEnding{"newton-failure", CellState::kStopped},
                                           RunEnding{"unsupported", CellState::kStopped},
                                           RunEnding{"step-limit", CellState::kLimit},
                                           RunEnding{"time-limit", CellState::kLimit},
                                           RunEnding{"process-time-limit", CellState::kLimit},
                                           RunEnding{"memory-limit", CellState::kLimit},
                                           RunEnding{"integrator-error", CellState::kBroken},
                                           RunEnding{"crashed", CellState::kBroken},
                                           RunEnding{"invalid-result", CellState::kBroken}};

/// Cell of the map, with its reasons.
struct MapCell {
  CellState state = CellState::kNotMeasured;
  /// Class: "singular", "time-limit", ... for an unexpected outcome, otherwise the state's name.
  std::string word = "not measured";
  std::string outcome;  ///< outcome of the deciding run
  std::string case_id;  ///< of the deciding run
  /// Deciding measure: the unmet measure furthest beyond its limit, otherwise the measure closest
  /// to its limit. Empty if the outcome decided.
  Judged decided;
  double t_reached = std::numeric_limits<double>::quiet_NaN();  ///< [s]
  std::size_t holding = 0, records = 0;
  /// Number of holding runs with warnings, and the warning codes with counts: "energy 2".
  std::size_t flagged = 0;
  std::string warnings;
  std::size_t cases = 0;  ///< expected number of records, at least `records`
  std::string reason;     ///< text: all measures beyond their limits, the run's message, ...
  bool demanded = false;
};

/// Evaluates one cell: its worst run. Only records of kind "accuracy" are used, unless a selection
/// names the kind.
MapCell JudgeCell(const MapRow& row, std::size_t column, const MapMethod& method,
                  std::span<const Record> records);

/// Returns true if the cell holds and one of its holding runs has a warning. The warning is then a
/// false alarm, or the map's demands are weaker.
inline bool HoldsWithWarnings(const MapCell& cell) {
  return cell.state == CellState::kHolds && cell.flagged > 0;
}

/// Rules, and the cells by group, row and column.
struct RobustnessMap {
  MapRules rules;
  std::vector<std::vector<std::vector<MapCell>>> cells;
  /// One sentence for each key of the rules that no record has: misspelt, or not run yet.
  std::vector<std::string> remarks;
};
RobustnessMap MakeRobustnessMap(const MapRules& rules, std::span<const Record> records);

/// Calls `visit` with group, row, column and cell of every cell, in the order of the rules.
template <class Map, class Visit>
void EachCell(Map& map, const Visit& visit) {
  for (std::size_t g = 0; g < map.cells.size(); ++g) {
    const MapGroup& group = map.rules.groups[g];
    for (std::size_t r = 0; r < map.cells[g].size(); ++r) {
      for (std::size_t c = 0; c < map.rules.columns.size(); ++c) {
        visit(group, group.rows[r], map.rules.columns[c], map.cells[g][r][c]);
      }
    }
  }
}

/// Returns the class, with the outcome if it is not "finished": "holds: locked".
std::string ClassText(const MapCell& cell);

/// Returns the deciding number: "branch 2.1e-09 rad", "397 of 400", "at 0.31 s"; "" if there is
/// none.
std::string DecidingNumber(const MapCell& cell);

/// Returns "3/4" if more than one record exists or is expected, otherwise "".
std::string HoldingCount(const MapCell& cell);

/// Returns "O-DCA, position / parallelogram: singular at 0.31 s" for each required cell that does
/// not hold.
std::vector<std::string> BrokenDemands(const RobustnessMap& map);

// Reads the rules of a robustness map (configs/experiments/extremes/map.json). Keys of the file:
// docs/fields.md, map.

/// Reads a file. Throws ConfigError with all errors (unknown keys, wrong types, unknown outcomes or
/// column labels, repeated labels, rows without criteria), each with file, JSON Pointer, found and
/// expected value.
MapRules ReadMapRules(const std::filesystem::path& path);

/// Reads rules from text; `file` is the name used in messages.
MapRules ParseMapRules(std::string_view text, const std::string& file);

}  // namespace loopbench::harness
