// Work-precision comparisons: rows, fronts, fairness, tables and documents.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <map>
#include <set>
#include <string_view>
#include <utility>

#include "harness/base/record.h"
#include "harness/base/text.h"
#include "harness/judge/analysis.h"
#include "harness/judge/judge.h"
#include "harness/judge/tables.h"

namespace loopbench::harness {
namespace {

constexpr std::array kErrors = {"error_position_max",    "error_position_end", "error_path_max",
                                "closed_form_error_max", "branch_error_max",   "energy_error_max",
                                "drift_position_max"};

constexpr const char* kWall = "wall_s_median";

bool HasNumber(std::span<const Record> records, const std::string& key, std::string_view kind) {
  return std::ranges::any_of(records, [&](const Record& record) {
    return record.Text("kind") == kind && std::isfinite(record.Number(key));
  });
}

/// Returns the name of a case without its kind: equal for a run and its timing.
std::string NameOfCase(const Record& record) {
  std::string text;
  for (const auto& [key, value] : record.items()) {
    if (key == "case_id" || key == "outcome") break;
    if (key != "kind" && key != "config_hash" && key != "set") {
      text += key + "=" + record.Text(key) + "\n";
    }
  }
  return text;
}

using Timings = std::map<std::string, const Record*>;

/// Returns the timing of the same case, or a record without keys.
const Record& TimingOf(const Record& run, const Timings& timings) {
  static const Record kNone;
  const auto place = timings.find(NameOfCase(run));
  return place == timings.end() ? kNone : *place->second;
}

std::string ErrorKey(std::span<const Record> records, const std::string& wanted,
                     std::vector<std::string>* remarks) {
  if (!wanted.empty()) {
    RequireKey("--error-key", wanted, records);
    if (HasNumber(records, wanted, "accuracy")) return wanted;
    throw ConfigError(fmt::format("--error-key {}: no accuracy record has a number there", wanted));
  }
  const auto* key = std::ranges::find_if(
      kErrors, [&](const char* one) { return HasNumber(records, one, "accuracy"); });
  if (key == kErrors.end()) {
    throw ConfigError(
        fmt::format("--error-key: no accuracy record has one of {}", fmt::join(kErrors, ", ")));
  }
  if (key == kErrors.begin()) return *key;
  // the last ones are indirect indicators, not distances from the exact motion
  const bool is_indicator = kErrors.end() - key <= 2;
  remarks->push_back(fmt::format(
      "no record has {} (errors against a certified reference): --error-key is {}{}",
      kErrors.front(), *key,
      is_indicator ? ", which is no distance from the right motion: a run may be far off and have "
                     "little of it"
                   : ""));
  return *key;
}

std::string CostKey(std::span<const Record> records, const Timings& timings,
                    const std::string& wanted, std::vector<std::string>* remarks) {
  if (!wanted.empty()) {
    const std::string key = wanted == "wall_s" ? kWall : wanted;
    RequireKey("--cost-key", key, records);
    if (HasNumber(records, key, "accuracy") || HasNumber(records, key, "timing")) return key;
    throw ConfigError(fmt::format("--cost-key {}: no record has a number there", wanted));
  }
  // timings of other cases, such as timings at a common tolerance, do not match
  const bool any = std::ranges::any_of(records, [&](const Record& record) {
    return record.Text("kind") == "accuracy" &&
           std::isfinite(TimingOf(record, timings).Number(kWall));
  });
  if (any) return kWall;
  remarks->push_back(
      "no accuracy case was timed as it is (\"timing\": {\"cases\": true} does it): --cost-key "
      "is rhs_equivalents");
  return "rhs_equivalents";
}

Record WithTiming(const Record& run, const Record& timing) {
  Record joined = run;
  for (const auto& [key, value] : timing.items()) {
    if (run.Find(key) == nullptr && !key.starts_with("series.")) joined.Set(key, value);
  }
  return joined;
}

std::string WhyNotCompared(const WorkPrecisionRow& row, const WorkPrecision& work_precision) {
  const Record& run = row.record;
  if (HasFailed(run)) {
    return fmt::format("{} at {:.3g} s", run.Text("outcome"), run.Number("t_reached"));
  }
  if (HasWarning(run)) return "warnings: " + run.Text("warnings");
  if (!std::isfinite(row.error)) return "no " + work_precision.error;
  if (std::isfinite(row.cost)) return "";
  if (work_precision.cost == kWall) {
    if (row.timing.items().empty()) return "not timed";
    if (row.timing.Text("outcome") != "finished") return "timing: " + row.timing.Text("outcome");
  }
  return "no " + work_precision.cost;
}

WorkPrecisionRow MakeRow(const Record& run, const Record& timing,
                         const WorkPrecision& work_precision) {
  WorkPrecisionRow row{.record = WithTiming(run, timing), .timing = timing};
  row.error = run.Number(work_precision.error);
  row.cost = row.record.Number(work_precision.cost);
  const double certified = run.Number("reference_error");
  if (IsErrorOfPositions(work_precision.error) && row.error <= certified) {
    row.is_bound = true;
    row.error += certified;
  }
  row.reason = WhyNotCompared(row, work_precision);
  return row;
}

/// Marks the front. Rows are sorted by cost, then error: a row is on the front if it is better than
/// all before it, or equal to a row of the front.
void MarkFront(std::vector<WorkPrecisionRow>* rows) {
  const WorkPrecisionRow* last = nullptr;
  for (WorkPrecisionRow& row : *rows) {
    if (!row.reason.empty()) continue;
    row.on_front = last == nullptr || row.error < last->error ||
                   (row.error == last->error && row.cost == last->cost);
    if (row.on_front) last = &row;
  }
}

/// Finds the first suitable rows, which are the cheapest: rows are in order of cost.
void FindCheapest(const std::vector<double>& classes, WorkPrecisionProblem* problem) {
  const std::vector<WorkPrecisionRow>& rows = problem->rows;
  std::set<std::string> formulations;
  for (const WorkPrecisionRow& row : rows) formulations.insert(row.record.Text("formulation"));
  for (const double error_class : classes) {
    const auto reaches = [&](const WorkPrecisionRow& row) {
      return row.reason.empty() && row.error <= error_class;
    };
    const auto least = std::ranges::find_if(rows, reaches);
    for (const std::string& formulation : formulations) {
      Cheapest& one = problem->cheapest.emplace_back(Cheapest{error_class, formulation});
      const auto found = std::ranges::find_if(rows, [&](const WorkPrecisionRow& row) {
        return reaches(row) && row.record.Text("formulation") == formulation;
      });
      if (found == rows.end()) continue;
      one.row = static_cast<int>(found - rows.begin());
      one.ratio = found->cost / least->cost;
    }
  }
}

bool IsCheaper(const WorkPrecisionRow& a, const WorkPrecisionRow& b) {
  const auto key = [](double value) {
    return std::isnan(value) ? std::numeric_limits<double>::infinity() : value;
  };
  return std::pair(key(a.cost), key(a.error)) < std::pair(key(b.cost), key(b.error));
}

}  // namespace

std::span<const char* const> UsualErrors() { return kErrors; }

bool IsErrorOfPositions(const std::string& key) {
  return key.starts_with("error_position") || key == "error_path_max";
}

WorkPrecision MakeWorkPrecision(std::span<const Record> records,
                                const WorkPrecisionOptions& options) {
  for (const std::string& key : options.per) RequireKey("--per", key, records);
  RequireConditions("--where", options.where, records);
  WorkPrecision work_precision;
  work_precision.error = ErrorKey(records, options.error, &work_precision.remarks);
  Timings timings;
  for (const Record& record : records) {
    if (record.Text("kind") == "timing") timings[NameOfCase(record)] = &record;
  }
  work_precision.cost = CostKey(records, timings, options.cost, &work_precision.remarks);
  std::vector<Record> runs = Filter(records, {{"kind", {"accuracy"}}});
  SortRows(&runs);  // equal costs stay in the order of tables
  std::map<std::string, std::size_t> places;
  for (const Record& run : runs) {
    WorkPrecisionRow row = MakeRow(run, TimingOf(run, timings), work_precision);
    if (!Matches(row.record, options.where)) continue;
    const std::string name = NameBy(run, options.per, ", ");
    const auto [place, is_new] = places.try_emplace(name, work_precision.problems.size());
    if (is_new) work_precision.problems.push_back({.name = name, .rows = {}, .cheapest = {}});
    work_precision.problems[place->second].rows.push_back(std::move(row));
  }
  if (work_precision.problems.empty()) {
    throw ConfigError(fmt::format("work-precision: no accuracy record{}{}",
                                  options.where.empty() ? "" : " matches ", ToText(options.where)));
  }
  for (WorkPrecisionProblem& problem : work_precision.problems) {
    std::ranges::stable_sort(problem.rows, IsCheaper);
    MarkFront(&problem.rows);
    FindCheapest(options.classes, &problem);
  }
  return work_precision;
}

namespace {

using Rows = std::vector<const WorkPrecisionRow*>;

/// Returns the rows, only the compared ones or only the others.
Rows RowsOf(const WorkPrecisionProblem& problem, bool compared) {
  Rows rows;
  for (const WorkPrecisionRow& row : problem.rows) {
    if (row.reason.empty() == compared) rows.push_back(&row);
  }
  return rows;
}

Rows RowsOf(const WorkPrecision& work_precision, bool compared) {
  Rows rows;
  for (const WorkPrecisionProblem& problem : work_precision.problems) {
    std::ranges::move(RowsOf(problem, compared), std::back_inserter(rows));
  }
  return rows;
}

/// Setting that may differ between runs, and its key in records.
struct Aspect {
  const char* words;
  const char* key;
  bool is_of_machine = false;  ///< affects times: taken from the timing if there is one
  const char* standard = "";   ///< value if the key is missing
};

constexpr std::array kAspects = {
    Aspect{"mechanism and start", "problem_id"},
    Aspect{"horizon [s]", "horizon"},
    Aspect{"simplifications", "preprocessed", false, "none"},
    Aspect{"formulation", "formulation"},
    Aspect{"enforcement", "enforcement"},
    Aspect{"coordinates", "coordinates"},
    Aspect{"solver", "solver"},
    Aspect{"integrator", "integrator"},
    Aspect{"Jacobians", "jacobian", false, "none"},
    Aspect{"tolerance", "rtol", false, "fixed step"},
    Aspect{"step [s]", "step", false, "by tolerance"},
    Aspect{"threads", "threads", false, "1"},
    Aspect{"execution", "execution", false, "library"},
    Aspect{"machine", "machine", true},
    Aspect{"compiler", "compiler", true},
    Aspect{"flags", "flags", true},
    Aspect{"mathematical library", "libm", true},
    Aspect{"commit", "commit", true},
    Aspect{"program", "version", true},
    Aspect{"CPU governor", "governor", true, "unknown"},
    Aspect{"repeats of timings", "repeats", true},
};

auto ByValue(const Rows& rows, const Aspect& aspect) {
  return GroupBy(rows, [&](const WorkPrecisionRow* row) {
    const bool of_timing = aspect.is_of_machine && row->timing.Find(aspect.key) != nullptr;
    const std::string text = (of_timing ? row->timing : row->record).Text(aspect.key);
    return text.empty() ? aspect.standard : text;
  });
}

bool IsTime(const std::string& cost) {
  return cost.starts_with("wall_s") || cost.starts_with("rhs_ns") || cost == "cpu_s" ||
         cost == "ns_per_body" || cost == "step_us_median";
}

/// Returns a line with the error, the certified error of references, and its influence.
std::string ErrorLine(const WorkPrecision& work_precision, const Rows& rows) {
  double least = INFINITY, most = 0.0;
  int bounds = 0, beyond = 0;
  for (const WorkPrecisionRow* row : rows) {
    const double certified = row->record.Number("reference_error");
    if (std::isfinite(certified)) {
      least = std::min(least, certified);
      most = std::max(most, certified);
    }
    bounds += row->is_bound;
    beyond += row->record.Number("reference_valid_until") < row->record.Number("horizon");
  }
  std::string line = "error: " + work_precision.error;
  if (std::isfinite(least) && work_precision.error.starts_with("error_")) {
    line += fmt::format(", against references certified to {:.1e}", least);
    if (most > least) line += fmt::format(" to {:.1e}", most);
    line += " m";
  }
  if (bounds > 0) {
    line += fmt::format("; {} row{} no larger error than that: the bound replaces {}", bounds,
                        bounds == 1 ? " has" : "s have", bounds == 1 ? "it" : "them");
  }
  if (beyond > 0) {
    line += fmt::format("; {} row{} beyond the validity limit of the reference of their problem",
                        beyond, beyond == 1 ? " goes" : "s go");
  }
  return line;
}

std::string CostLine(const WorkPrecision& work_precision, const Rows& rows) {
  const std::string& cost = work_precision.cost;
  if (cost == kWall) {
    return "cost: wall_s_median [s], simulations timed one at a time, without observers";
  }
  const bool is_count = cost.starts_with("rhs_e") || cost == "steps";
  const bool any = std::ranges::any_of(rows, [](const WorkPrecisionRow* row) {
    return row->record.Number("newton_iterations") > 0;
  });
  return "cost: " + WithUnit(cost) +
         (is_count && any ? "; of implicit integrators it leaves out Jacobians and linear solves, "
                            "so that they look cheaper than they are"
                          : "");
}

/// Returns true if compared formulations run library code, which is not equally optimized.
bool ComparesLibraryCode(const Rows& rows) {
  std::set<std::string> formulations;
  for (const WorkPrecisionRow* row : rows) {
    if (row->record.Text("execution").empty()) {
      formulations.insert(row->record.Text("formulation"));
    }
  }
  return formulations.size() > 1 && formulations.contains("odca");
}

}  // namespace

std::vector<std::string> FairnessStatement(const WorkPrecision& work_precision) {
  const Rows rows = RowsOf(work_precision, true), others = RowsOf(work_precision, false);
  std::vector<std::string> equal, unequal, unknown;
  bool one_machine = true;
  for (const Aspect& aspect : kAspects) {
    const auto values = ByValue(rows, aspect);
    if (values.empty()) continue;
    const std::string& first = values.front().first;
    const bool is_equal =
        std::ranges::all_of(work_precision.problems, [&](const WorkPrecisionProblem& problem) {
          return ByValue(RowsOf(problem, true), aspect).size() <= 1;
        });
    if (values.size() == 1 && first.empty()) {
      unknown.push_back(aspect.words);
    } else if (values.size() == 1) {
      equal.push_back(fmt::format("{} {}", aspect.words, first));
    } else if (is_equal) {
      equal.push_back(fmt::format("{} (in each problem)", aspect.words));
    } else {
      constexpr std::size_t kMaxShown = 8;
      const std::vector<std::string> shares = Mapped<std::string>(values, [](const auto& value) {
        return fmt::format("{} {}", value.first, value.second.size());
      });
      unequal.push_back(
          fmt::format("{} ({})", aspect.words, FirstOf(shares, kMaxShown, ", ", " and {} more")));
    }
    if (std::string_view(aspect.key) == "machine") one_machine = is_equal;
  }
  std::vector<std::string> lines = {ErrorLine(work_precision, rows),
                                    CostLine(work_precision, rows)};
  for (const auto& [words, list] : {std::pair("equal in all compared rows: ", &equal),
                                    {"not equal (rows): ", &unequal},
                                    {"not recorded: ", &unknown}}) {
    if (!list->empty()) lines.push_back(words + Joined(*list, "; "));
  }
  if (!others.empty()) {
    const auto without_numbers = [](const WorkPrecisionRow* row) {
      return row->reason.substr(0, row->reason.find(" at "));
    };
    lines.push_back(fmt::format("{} of {} rows are not compared: {}", others.size(),
                                rows.size() + others.size(),
                                CountWords(Mapped<std::string>(others, without_numbers))));
  }
  if (!IsTime(work_precision.cost)) return lines;
  if (ComparesLibraryCode(rows)) {
    lines.emplace_back(
        "not equal: the library's code. O-DCA has special code, vector instructions and fused "
        "multiply-add; other formulations have none. Equal code: execution generated; counts: "
        "loopbench count");
  }
  if (!one_machine) {
    lines.push_back("warning: the costs are times of more than one machine, which do not compare");
  }
  std::vector<Record> timings;
  for (const WorkPrecisionProblem& problem : work_precision.problems) {
    for (const WorkPrecisionRow& row : problem.rows) {
      if (!row.timing.items().empty()) timings.push_back(row.timing);
    }
  }
  std::ranges::move(NoiseWarnings(timings), std::back_inserter(lines));
  return lines;
}

namespace {

constexpr const char* kNobody = "none";

std::string FrontColour(const Record& row, const TableColumn& column) {
  if (column.key == "front") return row.Text("front") == "*" ? "32" : "";
  if (column.key != "reason") return "";
  if (HasFailed(row)) return "31";
  return row.Text("warnings").empty() ? "" : "33";
}

std::vector<Record> RecordsOfRows(const WorkPrecision& work_precision) {
  std::vector<Record> records;
  for (const WorkPrecisionProblem& problem : work_precision.problems) {
    for (const WorkPrecisionRow& row : problem.rows) records.push_back(row.record);
  }
  return records;
}

/// Returns the columns of methods. Compact tables have short words and no constant columns except
/// the formulation.
std::vector<TableColumn> MethodColumns(const std::vector<Record>& records, bool compact) {
  constexpr std::string_view kOthers[] = {"kind", "experiment", "mechanism", "horizon"};
  std::vector<TableColumn> columns;
  for (const std::string& key : CaseKeysOf(records)) {
    if (Contains(kOthers, key) || (key == "atol" && AtolFollowsRtol(records))) continue;
    if (compact && key != "formulation" && IsAlike(records, key)) continue;
    const TableColumn column = ColumnOf(key, records);
    columns.push_back(compact ? CompactCaseColumn(key).value_or(column) : column);
  }
  return columns;
}

Record ShownRow(const WorkPrecisionProblem& problem, const WorkPrecisionRow& row) {
  const auto number = [](double value) { return std::isfinite(value) ? Value(value) : Value(); };
  Record shown = row.record;
  shown.Set("problem", problem.name);
  shown.Set("front", std::string(row.on_front ? "*" : ""));
  shown.Set("error", number(row.error));
  shown.Set("error_is_bound", row.is_bound);
  shown.Set("cost", number(row.cost));
  shown.Set("reason", row.reason);
  return shown;
}

TableColumn ErrorColumn(const WorkPrecision& work_precision) {
  return {"error", WithUnit("error", work_precision.error), Format::kScientific};
}

TableColumn ClassColumn(const WorkPrecision& work_precision) {
  return {"error_class", WithUnit("error <=", work_precision.error), Format::kShortest};
}

TableColumn CostColumn(const WorkPrecision& work_precision) {
  const std::optional<TableColumn> known = KnownColumn(work_precision.cost);
  return {"cost", WithUnit("cost", work_precision.cost), known ? known->format : Format::kShortest};
}

/// Returns the columns of the rows; compact tables have the front first, and no details.
std::vector<TableColumn> RowColumns(const WorkPrecision& work_precision,
                                    const std::vector<Record>& records, bool compact) {
  std::vector<TableColumn> columns = Columns(compact ? "front=" : "problem");
  std::ranges::move(MethodColumns(records, compact), std::back_inserter(columns));
  columns.push_back(ErrorColumn(work_precision));
  if (!compact) columns.push_back({"error_is_bound", "is bound"});
  columns.push_back(CostColumn(work_precision));
  if (!compact) {
    columns.push_back({"front", "front"});
    const std::vector<std::string> keys = KeysOf(records);
    for (const char* key : {"outcome", "warnings", "reference_error", "reference_valid_until",
                            "steps", "rejected", "rhs_evaluations", "aa_spread_wall"}) {
      if (Contains(keys, key)) columns.push_back(ColumnOf(key, records));
    }
  }
  columns.push_back({"reason", "not compared because"});
  return columns;
}

/// "accel joint ode45 1e-06": the method within a formulation, by the keys that differ.
std::string MethodText(const Record& record, const std::vector<TableColumn>& columns) {
  std::string text;
  for (const TableColumn& column : columns) {
    const std::string cell = Cell(record, column);
    if (column.key == "formulation" || cell.empty()) continue;
    const bool is_bare = column.format == Format::kText || column.key == "rtol";
    text += fmt::format("{}{}{}", text.empty() ? "" : " ", is_bare ? "" : column.key + " ", cell);
  }
  return text;
}

const WorkPrecisionRow& RowOf(const WorkPrecisionProblem& problem, const Cheapest& one) {
  return problem.rows[static_cast<std::size_t>(one.row)];
}

}  // namespace

Table WorkPrecisionTable(const WorkPrecision& work_precision, const WorkPrecisionView& view) {
  Table table{.title = fmt::format("{} against {}", work_precision.error, work_precision.cost),
              .columns = RowColumns(work_precision, RecordsOfRows(work_precision), view.compact),
              .notes = work_precision.remarks,
              .group = "problem",
              .colour = &FrontColour};
  std::size_t hidden = 0;
  for (const WorkPrecisionProblem& problem : work_precision.problems) {
    for (const WorkPrecisionRow& row : problem.rows) {
      if (view.all || row.on_front || !row.reason.empty()) {
        table.rows.push_back(ShownRow(problem, row));
      } else {
        ++hidden;
      }
    }
  }
  table.notes.push_back(
      "* = Pareto front: no compared row is better in one value and as good in the other");
  if (hidden > 0) {
    table.notes.push_back(fmt::format("not shown: {} dominated rows (--all)", hidden));
  }
  return table;
}

Table OverviewTable(const WorkPrecision& work_precision) {
  std::set<std::string> names;
  for (const WorkPrecisionProblem& problem : work_precision.problems) {
    for (const Cheapest& one : problem.cheapest) names.insert(one.formulation);
  }
  Table table{.title = fmt::format(
                  "The cheapest method for an error: {}, and its ratio to the cheapest of all",
                  WithUnit(work_precision.cost)),
              .columns = {{"problem", "problem"}, ClassColumn(work_precision)}};
  for (const std::string& name : names) table.columns.push_back({name, name});
  for (const WorkPrecisionProblem& problem : work_precision.problems) {
    Record* row = nullptr;
    double last = kNoNumber;
    for (const Cheapest& one : problem.cheapest) {
      if (one.error_class != last) {
        row = &table.rows.emplace_back();
        row->Set("problem", problem.name);
        row->Set("error_class", last = one.error_class);
      }
      row->Set(one.formulation,
               one.row < 0 ? std::string(kNobody)
                           : fmt::format("{:.3g} ({:.2f})", RowOf(problem, one).cost, one.ratio));
    }
  }
  return table;
}

Table CheapestTable(const WorkPrecision& work_precision) {
  const std::vector<TableColumn> naming = MethodColumns(RecordsOfRows(work_precision), true);
  Table table{.title = "The cheapest methods",
              .columns = {{"problem", "problem"},
                          ClassColumn(work_precision),
                          {"formulation", "formulation"},
                          {"method", "method"},
                          ErrorColumn(work_precision),
                          CostColumn(work_precision),
                          {"ratio", "to the cheapest", Format::kExponent}}};
  for (const WorkPrecisionProblem& problem : work_precision.problems) {
    for (const Cheapest& one : problem.cheapest) {
      if (one.row < 0) {
        AddRow({problem.name, one.error_class, one.formulation, kNobody}, &table);
        continue;
      }
      const WorkPrecisionRow& row = RowOf(problem, one);
      AddRow({problem.name, one.error_class, one.formulation, MethodText(row.record, naming),
              row.error, row.cost, one.ratio},
             &table);
    }
  }
  return table;
}

std::string WorkPrecisionMarkdown(const WorkPrecision& work_precision,
                                  const std::vector<std::string>& notes) {
  Table overview = OverviewTable(work_precision);
  overview.notes = work_precision.remarks;
  overview.AddNotes(FairnessStatement(work_precision));
  Table rows = WorkPrecisionTable(work_precision, {.compact = false, .all = true});
  rows.AddNotes(notes);
  return ToMarkdown(overview) + "\n" + ToMarkdown(CheapestTable(work_precision)) + "\n" +
         ToMarkdown(rows);
}

}  // namespace loopbench::harness
