// Reports: data, and their HTML page.
#pragma once

#include "harness/figures/view.h"
#include "harness/judge/judge.h"

namespace loopbench::harness {

// Decimation of curves.

/// Returns ascending indices of the points to keep: the first, the last, and the minimum and
/// maximum of each of equal buckets in between. Keeps all points if there are at most `most` (at
/// least 4). A bucket without finite values keeps one point, so that the curve has its gap.
std::vector<std::size_t> KeepExtremes(std::span<const double> values, std::size_t most);

/// Returns at most `most` (at least 2) of `count` indices, evenly spaced, with the first and last.
std::vector<std::size_t> KeepEvenly(std::size_t count, std::size_t most);

// Data of the page of a store: computed from records, trajectories and references with the rules,
// tables and texts of the other commands, and free of HTML. The page (web/report/) displays them
// and evaluates nothing.

/// The stored motion of one run or of a reference.
struct ReportPath {
  std::string label = {};
  std::optional<std::size_t> row = {};  ///< row of the run; none for a reference
  std::vector<double> times = {};       ///< [s], ascending
  std::vector<Poses> poses = {};        ///< by time
  std::size_t stored = 0;               ///< number of times in the file
};

/// One mechanism with its motions.
struct ReportProblem {
  std::string name = {};                ///< as in ReportTable::problems
  std::optional<Picture> picture = {};  ///< none: see `missing`
  std::vector<ReportPath> paths = {};
  std::string missing = {};  ///< reason for no motion, and the setting that stores it; or empty
};

/// A sentence of the page, a filter for its rows of the first table, and a command that prints its
/// basis.
struct ReportFinding {
  bool failed = false;  ///< failure; else a warning
  std::string text = {};
  std::string filter = {};  ///< "outcome=singular", a condition on that table
};

/// All records of one kind, as in `loopbench table`. Columns without values are omitted. If there
/// are several rows, columns with one common value become text above the table.
struct ReportTable {
  std::string kind = {};  ///< "drift", "timing", ...
  std::string title = {};
  std::vector<TableColumn> columns = {};
  std::vector<std::string> alike = {};  ///< "solver: rank-revealing"
  std::vector<Record> rows = {};
  std::vector<std::string> names = {};     ///< labels of the rows, from their distinguishing keys
  std::vector<std::string> problems = {};  ///< of the rows: mechanism, horizon and other keys
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
  std::size_t points = 0, shown = 0;  ///< number of points in the store and on the page
};

/// Work-precision data for one error measure.
struct ReportCost {
  WorkPrecision work_precision = {};
  std::string error = {}, cost = {};       ///< with units
  std::vector<std::string> fairness = {};  ///< settings common to all compared rows
  std::string command = {};
};

struct ReportData {
  std::string store = {};
  std::size_t runs = 0, failed = 0, flagged = 0;  ///< accuracy runs
  std::vector<ClaimResult> claims = {};
  std::vector<ReportFinding> findings = {};
  std::vector<std::string> warning_notes = {};  ///< WarningNotes()
  std::vector<std::string> warnings = {};       ///< warnings about noise
  std::vector<ReportTable> tables = {};
  std::vector<ReportPlot> plots = {};
  std::vector<ReportCost> costs = {};
  std::optional<RobustnessMap> map = {};
  std::vector<ReportProblem> problems = {};
  std::vector<std::string> remarks = {};     ///< decimated or omitted data
  std::vector<std::string> changed = {};     ///< messages about files changed since their run
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
  std::size_t most_points = 1'000'000;  ///< maximum number of points of all curves together
};

/// Makes a report from `records` as returned by LoadRecords(), at least one. Reads trajectories,
/// mechanisms and references next to the store.
ReportData MakeReport(const std::vector<Record>& records, const ReportOptions& options);

// Writers of a report: JSON that is safe inside an HTML element, and a self-contained HTML page.

/// A data element of the page, which is parsed when it is first displayed.
struct DataElement {
  std::string id;
  std::string json;
};

/// Returns "tables", "costs", "map", "problems" and one "curves-NAME" per plot. Tables have numbers
/// with all digits, curves and poses with display precision.
std::vector<DataElement> ToJson(const ReportData& data);

/// web/report/ after uPlot and its licence, embedded when the program is built. Empty in a program
/// built without it (cmake -DLOOPBENCH_REPORT=OFF).
extern const std::string_view kReportScript, kReportStyle;

/// Writes the findings as text, for readers without script and for print; the script draws the rest
/// from the data.
std::string ToHtml(const ReportData& data);

}  // namespace loopbench::harness
