#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <map>
#include <ranges>
#include <set>
#include <string_view>
#include <utility>

#include "harness/base/record.h"
#include "harness/base/text.h"
#include "harness/judge/judge.h"
#include "harness/judge/tables.h"

namespace loopbench::harness {
namespace {

constexpr std::array kErrors = {"error_position_max",    "error_position_end", "error_path_max",
                                "closed_form_error_max", "branch_error_max",   "energy_error_max",
                                "drift_position_max"};
// indirect indicators, not distances from the exact motion
constexpr std::array kNoErrors = {"energy_error_max", "drift_position_max"};

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

std::string ErrorKey(std::span<const Record> records, const WorkPrecisionOptions& options,
                     std::vector<std::string>* remarks) {
  if (!options.error.empty()) {
    RequireKey("--error-key", options.error, records);
    if (HasNumber(records, options.error, "accuracy")) return options.error;
    throw ConfigError(
        fmt::format("--error-key {}: no accuracy record has a number there", options.error));
  }
  for (const std::string key : kErrors) {
    if (!HasNumber(records, key, "accuracy")) continue;
    if (key == kErrors.front()) return key;
    remarks->push_back(fmt::format(
        "no record has {} (errors against a certified reference): --error-key is {}{}",
        kErrors.front(), key,
        Contains(kNoErrors, key)
            ? ", which is no distance from the right motion: a run may be far off and have little "
              "of it"
            : ""));
    return key;
  }
  throw ConfigError(
      fmt::format("--error-key: no accuracy record has one of {}", fmt::join(kErrors, ", ")));
}

/// Timings by the name of their case.
using Timings = std::map<std::string, const Record*>;

/// Returns the timing of the same case, or a record without keys.
const Record& TimingOf(const Record& run, const Timings& timings) {
  static const Record kNone;
  const auto place = timings.find(NameOfCase(run));
  return place == timings.end() ? kNone : *place->second;
}

std::string CostKey(std::span<const Record> records, const Timings& timings,
                    const WorkPrecisionOptions& options, std::vector<std::string>* remarks) {
  if (options.cost.empty()) {
    // timings of other cases, such as timings at a common tolerance, do not match
    const bool any = std::ranges::any_of(records, [&](const Record& record) {
      return record.Text("kind") == "accuracy" &&
             std::isfinite(TimingOf(record, timings).Number(kWall));
    });
    if (any) return kWall;
    remarks->push_back(
        "no accuracy case was timed as it is (\"timing\": {\"cases\": true} does it): --cost-key "
        "is "
        "rhs_equivalents");
    return "rhs_equivalents";
  }
  const std::string key = options.cost == "wall_s" ? kWall : options.cost;
  RequireKey("--cost-key", key, records);
  if (HasNumber(records, key, "accuracy") || HasNumber(records, key, "timing")) return key;
  throw ConfigError(fmt::format("--cost-key {}: no record has a number there", options.cost));
}

/// Returns the run with additional keys of its timing.
Record WithTiming(const Record& run, const Record& timing) {
  Record joined = run;
  for (const auto& [key, value] : timing.items()) {
    if (run.Find(key) == nullptr && !key.starts_with("series.")) joined.Set(key, value);
  }
  return joined;
}

std::string WhyNoCost(const WorkPrecisionRow& row, const WorkPrecision& work_precision) {
  if (std::isfinite(row.cost)) return "";
  const bool is_time = work_precision.cost == kWall;
  if (is_time && row.timing.items().empty()) return "not timed";
  const std::string outcome = row.timing.Text("outcome");
  if (is_time && outcome != "finished") return "timing: " + outcome;
  return "no " + work_precision.cost;
}

std::string WhyNotCompared(const WorkPrecisionRow& row, const WorkPrecision& work_precision) {
  if (HasFailed(row.record)) {
    return fmt::format("{} at {:.3g} s", row.record.Text("outcome"),
                       row.record.Number("t_reached"));
  }
  if (const std::string warnings = row.record.Text("warnings"); !warnings.empty()) {
    return "warnings: " + warnings;
  }
  if (!std::isfinite(row.error)) return "no " + work_precision.error;
  return WhyNoCost(row, work_precision);
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

/// "four-bar, horizon 10": texts unchanged, numbers with their key.
std::string NameOfProblem(const Record& record, const std::vector<std::string>& per) {
  std::string name;
  for (const std::string& key : per) {
    const Value* value = record.Find(key);
    const bool is_text = value != nullptr && std::holds_alternative<std::string>(*value);
    name += (name.empty() ? "" : ", ") + (is_text ? "" : key + " ") + record.Text(key);
  }
  return name;
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

std::vector<std::string> FormulationsOf(const std::vector<WorkPrecisionRow>& rows) {
  std::set<std::string> names;
  for (const WorkPrecisionRow& row : rows) names.insert(row.record.Text("formulation"));
  return {names.begin(), names.end()};
}

/// Returns the first suitable row, which is the cheapest: rows are in order of cost.
int CheapestOf(const std::vector<WorkPrecisionRow>& rows, const std::string& formulation,
               double error_class) {
  const auto found = std::ranges::find_if(rows, [&](const WorkPrecisionRow& row) {
    return row.reason.empty() && row.error <= error_class &&
           row.record.Text("formulation") == formulation;
  });
  return found == rows.end() ? -1 : static_cast<int>(found - rows.begin());
}

void FindCheapest(const std::vector<double>& classes, WorkPrecisionProblem* problem) {
  const std::vector<WorkPrecisionRow>& rows = problem->rows;
  for (const double error_class : classes) {
    const std::size_t first = problem->cheapest.size();
    double least = std::numeric_limits<double>::infinity();
    for (const std::string& formulation : FormulationsOf(rows)) {
      const int row = CheapestOf(rows, formulation, error_class);
      problem->cheapest.push_back(
          {.error_class = error_class, .formulation = formulation, .row = row});
      if (row >= 0) least = std::min(least, rows[static_cast<std::size_t>(row)].cost);
    }
    for (Cheapest& one : problem->cheapest | std::views::drop(first)) {
      if (one.row >= 0) one.ratio = rows[static_cast<std::size_t>(one.row)].cost / least;
    }
  }
}

/// Compares costs; NaN comes last.
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
  work_precision.error = ErrorKey(records, options, &work_precision.remarks);
  Timings timings;
  for (const Record& record : records) {
    if (record.Text("kind") == "timing") timings[NameOfCase(record)] = &record;
  }
  work_precision.cost = CostKey(records, timings, options, &work_precision.remarks);
  std::vector<Record> runs = Filter(records, {{"kind", {"accuracy"}}});
  SortRows(&runs);  // equal costs stay in the order of tables
  std::map<std::string, std::size_t> places;
  for (const Record& run : runs) {
    WorkPrecisionRow row = MakeRow(run, TimingOf(run, timings), work_precision);
    if (!Matches(row.record, options.where)) continue;
    const std::string name = NameOfProblem(run, options.per);
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

/// Returns the rows of all problems, only the compared ones or only the others.
std::vector<const WorkPrecisionRow*> RowsOf(const WorkPrecision& work_precision, bool compared) {
  std::vector<const WorkPrecisionRow*> rows;
  for (const WorkPrecisionProblem& problem : work_precision.problems) {
    for (const WorkPrecisionRow& row : problem.rows) {
      if (row.reason.empty() == compared) rows.push_back(&row);
    }
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

std::string ValueOf(const WorkPrecisionRow& row, const Aspect& aspect) {
  const bool of_timing = aspect.is_of_machine && row.timing.Find(aspect.key) != nullptr;
  const std::string text = (of_timing ? row.timing : row.record).Text(aspect.key);
  return text.empty() ? aspect.standard : text;
}

/// Values of one setting in the compared rows of all problems.
struct ValueShares {
  bool is_equal = true;  ///< within each problem
  /// In order of first appearance, with the number of rows.
  std::vector<std::pair<std::string, int>> values;
};

ValueShares FindValues(const WorkPrecision& work_precision, const Aspect& aspect) {
  ValueShares finding;
  for (const WorkPrecisionProblem& problem : work_precision.problems) {
    std::set<std::string> own;
    for (const WorkPrecisionRow& row : problem.rows) {
      if (!row.reason.empty()) continue;
      const std::string value = ValueOf(row, aspect);
      own.insert(value);
      auto place = std::ranges::find(finding.values, value, &std::pair<std::string, int>::first);
      if (place == finding.values.end()) place = finding.values.insert(place, {value, 0});
      ++place->second;
    }
    finding.is_equal = finding.is_equal && own.size() <= 1;
  }
  return finding;
}

/// "integrator (ode45 40, verner 38)"; long lists are cut.
std::string Shares(const Aspect& aspect, const ValueShares& finding) {
  constexpr std::size_t kMaxShown = 8;
  const std::size_t more = finding.values.size() - std::min(finding.values.size(), kMaxShown);
  return fmt::format(
      "{} ({}{})", aspect.words,
      Joined(finding.values | std::views::take(kMaxShown), ", ",
             [](const auto& one) { return fmt::format("{} {}", one.first, one.second); }),
      more > 0 ? fmt::format(" and {} more", more) : "");
}

bool IsTime(const std::string& cost) {
  return cost.starts_with("wall_s") || cost.starts_with("rhs_ns") || cost == "cpu_s" ||
         cost == "ns_per_body" || cost == "step_us_median";
}

/// Returns a line with the error, the certified error of references, and its influence.
std::string ErrorLine(const WorkPrecision& work_precision) {
  double least = INFINITY, most = 0.0;
  int bounds = 0, beyond = 0;
  for (const WorkPrecisionRow* row : RowsOf(work_precision, true)) {
    const double certified = row->record.Number("reference_error");
    if (std::isfinite(certified)) {
      least = std::min(least, certified);
      most = std::max(most, certified);
    }
    bounds += row->is_bound ? 1 : 0;
    beyond += row->record.Number("reference_valid_until") < row->record.Number("horizon") ? 1 : 0;
  }
  std::string line = fmt::format("error: {}", work_precision.error);
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

std::string CostLine(const WorkPrecision& work_precision) {
  if (work_precision.cost == "wall_s_median") {
    return "cost: wall_s_median [s], simulations timed one at a time, without observers";
  }
  std::string line = "cost: " + WithUnit(work_precision.cost, work_precision.cost);
  const bool is_count = work_precision.cost.starts_with("rhs_e") || work_precision.cost == "steps";
  const bool any = std::ranges::any_of(
      RowsOf(work_precision, true),
      [](const WorkPrecisionRow* row) { return row->record.Number("newton_iterations") > 0; });
  if (is_count && any) {
    line +=
        "; of implicit integrators it leaves out Jacobians and linear solves, so that they look "
        "cheaper than they are";
  }
  return line;
}

/// Returns true if compared formulations run library code, which is not equally optimized.
bool ComparesLibraryCode(const WorkPrecision& work_precision) {
  std::set<std::string> formulations;
  for (const WorkPrecisionRow* row : RowsOf(work_precision, true)) {
    if (row->record.Text("execution").empty()) {
      formulations.insert(row->record.Text("formulation"));
    }
  }
  return formulations.size() > 1 && formulations.contains("odca");
}

}  // namespace

std::vector<std::string> FairnessStatement(const WorkPrecision& work_precision) {
  std::vector<std::string> equal, unequal, unknown, lines;
  bool one_machine = true;
  for (const Aspect& aspect : kAspects) {
    const ValueShares finding = FindValues(work_precision, aspect);
    if (finding.values.empty()) continue;
    const std::string& first = finding.values.front().first;
    const bool is_single = finding.values.size() == 1;
    if (is_single && first.empty()) {
      unknown.push_back(aspect.words);
    } else if (is_single) {
      equal.push_back(fmt::format("{} {}", aspect.words, first));
    } else if (finding.is_equal) {
      equal.push_back(fmt::format("{} (in each problem)", aspect.words));
    } else {
      unequal.push_back(Shares(aspect, finding));
    }
    if (std::string_view(aspect.key) == "machine") one_machine = finding.is_equal;
  }
  lines.push_back(ErrorLine(work_precision));
  lines.push_back(CostLine(work_precision));
  if (!equal.empty()) lines.push_back("equal in all compared rows: " + Joined(equal, "; "));
  if (!unequal.empty()) lines.push_back("not equal (rows): " + Joined(unequal, "; "));
  if (!unknown.empty()) lines.push_back("not recorded: " + Joined(unknown, "; "));
  std::vector<std::string> reasons;  // without their numbers
  for (const WorkPrecisionRow* row : RowsOf(work_precision, false)) {
    reasons.push_back(row->reason.substr(0, row->reason.find(" at ")));
  }
  std::size_t all = 0;
  std::vector<Record> timings;
  for (const WorkPrecisionProblem& problem : work_precision.problems) {
    all += problem.rows.size();
    for (const WorkPrecisionRow& row : problem.rows) {
      if (!row.timing.items().empty()) timings.push_back(row.timing);
    }
  }
  if (!reasons.empty()) {
    lines.push_back(fmt::format("{} of {} rows are not compared: {}", reasons.size(), all,
                                CountWords(reasons)));
  }
  if (!IsTime(work_precision.cost)) return lines;
  if (ComparesLibraryCode(work_precision)) {
    lines.emplace_back(
        "not equal: the library's code. O-DCA has special code, vector instructions and fused "
        "multiply-add; other formulations have none. Equal code: execution generated; counts: "
        "loopbench count");
  }
  if (!one_machine) {
    lines.push_back("warning: the costs are times of more than one machine, which do not compare");
  }
  std::ranges::move(NoiseWarnings(timings), std::back_inserter(lines));
  return lines;
}

}  // namespace loopbench::harness
