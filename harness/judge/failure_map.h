// Which methods pass which stress tests: rules, their file, cells.
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

// The robustness map: methods against extremes, each cell judged from records by rules.
//
// A rules file (configs/experiments/extremes/map.json) names columns (methods), rows (extremes) and
// for each row the measures that decide. A cell's class and the number that decided it follow from
// the records alone, so that other data turn it and nobody writes it by hand.

/// One extreme.
struct MapRow {
  std::string label;
  Selection select;                               ///< which records, with the column's selection
  std::vector<Demand> decides;                    ///< all must be met
  std::vector<std::string> right = {"finished"};  ///< how a run should end
  std::vector<bool> must_hold;                    ///< by column: whether the gate asks for it
  std::map<std::string, std::string> not_applicable;  ///< reason by column label
  std::string others_not_applicable;  ///< reason for all other columns that need not hold, or ""
  std::size_t cases = 1;              ///< fewer records than these do not hold
  std::string why;                    ///< where the limits come from
};

struct MapGroup {
  std::string label;
  std::string short_label;  ///< for pictures, or ""
  std::vector<MapRow> rows;
};

/// One method.
struct MapColumn {
  std::string label;
  Selection select;
};

struct MapRules {
  std::string title, comment;
  std::vector<MapColumn> columns;
  std::vector<MapGroup> groups;
};

/// What may become of a cell, from good to bad: of several records the worst decides. A number that
/// is wrong without a word is worse than a run that ends and says why, or that does not end.
enum class CellState {
  kHolds,          ///< ended as it should, every measure as demanded
  kNotApplicable,  ///< no record, and the rules say why there is none
  kNotMeasured,    ///< too few records, or one without a measure that decides
  kStopped,        ///< ended early with a numerical reason: singular, locked, ...
  kLimit,          ///< did not end by itself: step-limit, time-limit, ...
  kInaccurate,     ///< ended as if all were well, with a measure that is not as demanded
  kBroken,         ///< crashed, or answered what is no result
};
inline constexpr std::array kCellStates = {CellState::kHolds,        CellState::kStopped,
                                           CellState::kLimit,        CellState::kInaccurate,
                                           CellState::kBroken,       CellState::kNotMeasured,
                                           CellState::kNotApplicable};  ///< in the order of legends

/// "holds", "stopped", "limit", "inaccurate", "broken", "not measured", "not applicable".
std::string_view ToString(CellState state);

/// All endings of runs that rules may name, and the state of a run that should have ended
/// otherwise.
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

/// What a cell shows and why.
struct MapCell {
  CellState state = CellState::kNotMeasured;
  /// The class: "singular", "time-limit", ... for a run that ended so and should not; else the
  /// state's name.
  std::string word = "not measured";
  std::string outcome;  ///< of the run that decided
  std::string case_id;  ///< of that run
  /// What decided: of the measures that are not as demanded the one furthest beyond its limit, else
  /// the one closest to its limit. Without a measure where the ending decided.
  Judged decided;
  double t_reached = std::numeric_limits<double>::quiet_NaN();  ///< [s]
  std::size_t holding = 0, records = 0;
  /// Of the runs that hold those with a doubt, and its codes, each with how often: "energy 2".
  std::size_t doubted = 0;
  std::string doubts;
  std::size_t cases = 0;  ///< how many records there should be, at least `records`
  std::string reason;     ///< in words: all measures beyond their limits, the run's message, ...
  bool demanded = false;
};

/// The judgement on one run.
MapCell JudgeRun(const MapRow& row, const Record& record);

/// The judgement on one cell: the worst of its runs. Records of kind "accuracy" count, unless a
/// selection names the kind.
MapCell JudgeCell(const MapRow& row, std::size_t column, const MapColumn& method,
                  std::span<const Record> records);

/// Whether the cell holds and one of its runs that hold has a doubt: that run is right by what the
/// map demands, so that the doubt is a false alarm, or the map demands less.
inline bool HoldsInDoubt(const MapCell& cell) {
  return cell.state == CellState::kHolds && cell.doubted > 0;
}

/// Rules and, by group, row and column, the cells.
struct FailureMap {
  MapRules rules;
  std::vector<std::vector<std::vector<MapCell>>> cells;
  /// Keys that rules name and no record has: misspelt, or not run yet. One sentence each.
  std::vector<std::string> remarks;
};
FailureMap MakeFailureMap(const MapRules& rules, std::span<const Record> records);

/// Calls `visit` with group, row, column and cell of every cell, in the order of the rules.
template <class Visit>
void EachCell(const FailureMap& map, const Visit& visit) {
  for (std::size_t g = 0; g < map.cells.size(); ++g) {
    const MapGroup& group = map.rules.groups[g];
    for (std::size_t r = 0; r < map.cells[g].size(); ++r) {
      for (std::size_t c = 0; c < map.rules.columns.size(); ++c) {
        visit(group, group.rows[r], map.rules.columns[c], map.cells[g][r][c]);
      }
    }
  }
}

/// The class, with the ending where another one than "finished" is right: "holds: locked".
std::string ClassText(const MapCell& cell);

/// The number that decided: "branch 2.1e-09 rad", "397 of 400", "at 0.31 s"; "" where there is
/// none.
std::string DecidingNumber(const MapCell& cell);

/// "3/4" where there is, or should be, more than one record, else "".
std::string HoldingCount(const MapCell& cell);

/// "O-DCA, position / parallelogram: singular at 0.31 s" for every cell that must hold and does
/// not.
std::vector<std::string> BrokenDemands(const FailureMap& map);

// Reads the rules of a robustness map (configs/experiments/extremes/map.json).
// What such a file may hold: docs/fields.md, map.

/// Reads a file. Throws ConfigError with all mistakes in it (unknown keys, wrong types, an ending
/// or a column label that does not exist, a label used twice, a row that nothing decides), each
/// with file, JSON Pointer, value found and what was expected.
MapRules ReadMapRules(const std::filesystem::path& path);

/// The same from text; `file` is the name used in messages.
MapRules ParseMapRules(std::string_view text, const std::string& file);

}  // namespace loopbench::harness
