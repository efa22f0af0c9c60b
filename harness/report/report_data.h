// The data of a report: motions, curves, tables.
#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "harness/judge/claims.h"
#include "harness/judge/failure_map.h"
#include "harness/judge/tradeoff.h"
#include "harness/record/record.h"
#include "harness/tables/table.h"
#include "harness/view/picture.h"

namespace loopbench::harness {

// Fewer points of a curve, without losing its extremes.

/// Which of the points of a curve are kept, ascending: the first and the last, and of each of equal
/// buckets of points in between the least and the largest value. All of them where there are at
/// most `most` (at least 4). What is not finite is kept only where a bucket has nothing else: one
/// point, so that the curve has its gap.
std::vector<std::size_t> KeepExtremes(std::span<const double> values, std::size_t most);

/// At most `most` (at least 2) of `count` places, evenly, with the first and the last.
std::vector<std::size_t> KeepEvenly(std::size_t count, std::size_t most);

// Where the bodies of a store's scenes are over time: from trajectories and references that are
// kept beside it. Nothing is integrated here.

/// The motion of one run, or of a reference.
struct ReportPath {
  std::string label = {};
  std::optional<std::size_t> row = {};  ///< of the run; none for a reference
  std::vector<double> times = {};       ///< [s], ascending
  std::vector<Poses> poses = {};        ///< by time
  std::size_t stored = 0;               ///< times that the file has
};

/// One mechanism with its motions.
struct ReportScene {
  std::string name = {};                ///< as in ReportTable::scenes
  std::optional<Picture> picture = {};  ///< none: see `missing`
  std::vector<ReportPath> paths = {};
  std::string missing =
      {};  ///< why there is no motion, and what to write into the experiment; or empty
};

/// Scenes in the order of the rows, whose names and scenes are given beside them. `changed` gets
/// the messages of files that are not as their run wrote them.
std::vector<ReportScene> FindScenes(const std::vector<Record>& rows,
                                    const std::vector<std::string>& names,
                                    const std::vector<std::string>& scenes,
                                    const std::filesystem::path& store_file,
                                    std::vector<std::string>* remarks,
                                    std::vector<std::string>* changed);

/// Above so many scenes none is drawn any more, above so many motions none of a scene; and places
/// of bodies in all motions of a page.
inline constexpr std::size_t kMostScenes = 12, kMostPaths = 60, kMostPlaces = 120'000;

// What the page of a whole run shows: plain data, computed from records by the same judges, tables
// and words as the other commands, and no word of HTML. The page (web/report/) shows it and judges
// nothing.

/// A sentence of the page, the rows of the first table that it is about, and the command that
/// prints what it follows from.
struct ReportFinding {
  bool failed = false;  ///< else doubtful
  std::string text = {};
  std::string filter = {};  ///< "outcome=singular", a condition on that table
};

/// All records of one kind, as `loopbench table` has them. Columns in which no row has a value are
/// left out; those in which all rows are alike are words above the table, once there are several
/// rows.
struct ReportTable {
  std::string kind = {};  ///< "drift", "timing", ...
  std::string title = {};
  std::vector<TableColumn> columns = {};
  std::vector<std::string> alike = {};  ///< "solver: rank-revealing"
  std::vector<Record> rows = {};
  std::vector<std::string> names = {};  ///< of the rows, by what tells them apart
  std::vector<std::string> scenes =
      {};  ///< of the rows: mechanism, horizon and what else is one scene
  std::string command = {};
};

/// A series of one row of the first table.
struct ReportCurve {
  std::size_t row = 0;
  std::vector<double> t = {}, y = {};
};

/// All curves of one quantity against time.
struct ReportPlot {
  std::string name = {};   ///< "drift"
  std::string title = {};  ///< "Drift"
  std::string unit = {};   ///< of y
  std::vector<ReportCurve> curves = {};
  std::size_t points = 0, shown = 0;  ///< of the store, and of the page
};

/// Work and precision by one error.
struct ReportCost {
  Tradeoff tradeoff = {};
  std::string error = {}, cost = {};       ///< with units
  std::vector<std::string> fairness = {};  ///< what was equal among the compared rows
  std::string command = {};
};

struct ReportData {
  std::string store = {};
  std::size_t runs = 0, failed = 0, doubted = 0;  ///< accuracy runs
  std::vector<ClaimResult> claims = {};
  std::vector<ReportFinding> findings = {};
  std::vector<std::string> doubts = {};    ///< DoubtNotes()
  std::vector<std::string> warnings = {};  ///< of noise
  std::vector<ReportTable> tables = {};
  std::vector<ReportPlot> plots = {};
  std::vector<ReportCost> costs = {};
  std::optional<FailureMap> map = {};
  std::vector<ReportScene> scenes = {};
  std::vector<std::string> remarks = {};     ///< what was decimated or left out
  std::vector<std::string> changed = {};     ///< files of the store that no run wrote so
  std::vector<std::string> origins = {};     ///< of the records: machine, compiler, commit, ...
  std::vector<std::string> provenance = {};  ///< of the page
  std::string map_command = {}, claims_command = {}, plot_command = {};
};

struct ReportOptions {
  std::filesystem::path store = {};
  std::optional<MapRules> rules = {};
  std::filesystem::path rules_file = {};
  std::vector<ClaimRule> claims = {};
  std::filesystem::path claims_file = {};
  std::size_t most_points = 1'000'000;  ///< of all curves together
};

/// `records` as LoadRecords() gives them, at least one. Trajectories, mechanisms and references are
/// read from beside the store.
ReportData MakeReport(const std::vector<Record>& records, const ReportOptions& options);

// The series of records as curves against time.

/// Drift, energy error and true error of the rows that have them; together at most `most` points,
/// shared evenly among the curves, with the extremes of each.
std::vector<ReportPlot> MakePlots(const std::vector<Record>& rows, std::size_t most);

}  // namespace loopbench::harness
