// What the page of a whole run shows: plain data, computed from records by the same judges, tables
// and words as the other commands, and no word of HTML. The page (web/report/) shows it and judges
// nothing.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "harness/judge/claims.h"
#include "harness/judge/failure_map.h"
#include "harness/judge/tradeoff.h"
#include "harness/report/motions.h"
#include "harness/tables/table.h"

namespace loopbench::harness {

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

}  // namespace loopbench::harness
