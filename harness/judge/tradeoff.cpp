#include "harness/judge/tradeoff.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <string_view>
#include <utility>

#include "harness/tables/columns.h"
#include "harness/tables/table.h"
#include "harness/text/config_error.h"

namespace loopbench::harness {
namespace {

constexpr std::array kErrors = {"error_position_max",    "error_position_end", "error_shape_max",
                                "closed_form_error_max", "branch_error_max",   "energy_error_max",
                                "drift_position_max"};
// those that are no distance from the right motion
constexpr std::array kNoErrors = {"energy_error_max", "drift_position_max"};

constexpr const char* kWall = "wall_s_median";

bool HasNumber(std::span<const Record> records, const std::string& key, std::string_view kind) {
  return std::ranges::any_of(records, [&](const Record& record) {
    return record.Text("kind") == kind && std::isfinite(record.Number(key));
  });
}

/// All that names a case, but what it was run for: equal for a run and its timing.
std::string NameOfCase(const Record& record) {
  std::string text;
  for (const auto& [key, value] : record.items()) {
    if (key == "case_id" || key == "outcome") break;
    if (key != "kind" && key != "content" && key != "set") {
      text += key + "=" + record.Text(key) + "\n";
    }
  }
  return text;
}

std::string ErrorKey(std::span<const Record> records, const TradeoffOptions& options,
                     std::vector<std::string>* remarks) {
  if (!options.error.empty()) {
    RequireKey("--error", options.error, records);
    if (HasNumber(records, options.error, "accuracy")) return options.error;
    throw ConfigError(
        fmt::format("--error {}: no accuracy record has a number there", options.error));
  }
  for (const std::string key : kErrors) {
    if (!HasNumber(records, key, "accuracy")) continue;
    if (key == kErrors.front()) return key;
    const bool is_none = std::ranges::find(kNoErrors, key) != kNoErrors.end();
    remarks->push_back(fmt::format(
        "no record has {} (errors against a certified reference): --error is {}{}", kErrors.front(),
        key,
        is_none ? ", which is no distance from the right motion: a run may be far off and have "
                  "little of it"
                : ""));
    return key;
  }
  throw ConfigError(
      fmt::format("--error: no accuracy record has one of {}", fmt::join(kErrors, ", ")));
}

/// Timings by the name of their case.
using Timings = std::map<std::string, const Record*>;

/// Of the same case; a record without keys where there is none.
const Record& TimingOf(const Record& run, const Timings& timings) {
  static const Record kNone;
  const auto place = timings.find(NameOfCase(run));
  return place == timings.end() ? kNone : *place->second;
}

std::string CostKey(std::span<const Record> records, const Timings& timings,
                    const TradeoffOptions& options, std::vector<std::string>* remarks) {
  if (options.cost.empty()) {
    // timings of other cases, such as those at one tolerance for all, are none of these
    const bool any = std::ranges::any_of(records, [&](const Record& record) {
      return record.Text("kind") == "accuracy" &&
             std::isfinite(TimingOf(record, timings).Number(kWall));
    });
    if (any) return kWall;
    remarks->push_back(
        "no accuracy case was timed as it is (\"timing\": {\"cases\": true} does it): --cost is "
        "rhs_equivalents");
    return "rhs_equivalents";
  }
  const std::string key = options.cost == "wall_s" ? kWall : options.cost;
  RequireKey("--cost", key, records);
  if (HasNumber(records, key, "accuracy") || HasNumber(records, key, "timing")) return key;
  throw ConfigError(fmt::format("--cost {}: no record has a number there", options.cost));
}

/// The run with what only its timing has.
Record Joined(const Record& run, const Record& timing) {
  Record joined = run;
  for (const auto& [key, value] : timing.items()) {
    if (run.Find(key) == nullptr && !key.starts_with("series.")) joined.Set(key, value);
  }
  return joined;
}

std::string WhyNoCost(const TradeoffRow& row, const Tradeoff& tradeoff) {
  if (std::isfinite(row.cost)) return "";
  const bool is_time = tradeoff.cost == kWall;
  if (is_time && row.timing.items().empty()) return "not timed";
  const std::string outcome = row.timing.Text("outcome");
  if (is_time && outcome != "finished") return "timing: " + outcome;
  return "no " + tradeoff.cost;
}

std::string WhyNotCompared(const TradeoffRow& row, const Tradeoff& tradeoff) {
  if (HasFailed(row.record)) {
    return fmt::format("{} at {:.3g} s", row.record.Text("outcome"),
                       row.record.Number("t_reached"));
  }
  if (const std::string doubts = row.record.Text("doubts"); !doubts.empty()) {
    return "doubts: " + doubts;
  }
  if (!std::isfinite(row.error)) return "no " + tradeoff.error;
  return WhyNoCost(row, tradeoff);
}

TradeoffRow MakeRow(const Record& run, const Record& timing, const Tradeoff& tradeoff) {
  TradeoffRow row{.record = Joined(run, timing), .timing = timing};
  row.error = run.Number(tradeoff.error);
  row.cost = row.record.Number(tradeoff.cost);
  const double certified = run.Number("reference_error");
  if (IsErrorOfPositions(tradeoff.error) && row.error <= certified) {
    row.is_bound = true;
    row.error += certified;
  }
  row.reason = WhyNotCompared(row, tradeoff);
  return row;
}

/// "four-bar, horizon 10": texts as they are, numbers with their key.
std::string NameOfProblem(const Record& record, const std::vector<std::string>& per) {
  std::string name;
  for (const std::string& key : per) {
    const Value* value = record.Find(key);
    const bool is_text = value != nullptr && std::holds_alternative<std::string>(*value);
    name +=
        fmt::format("{}{}{}", name.empty() ? "" : ", ", is_text ? "" : key + " ", record.Text(key));
  }
  return name;
}

/// Rows are in order of cost, those of one cost in order of error: a row is on the front if it is
/// better than all before it, or has an equal there.
void MarkFront(std::vector<TradeoffRow>* rows) {
  const TradeoffRow* last = nullptr;
  for (TradeoffRow& row : *rows) {
    if (!row.reason.empty()) continue;
    row.on_front = last == nullptr || row.error < last->error ||
                   (row.error == last->error && row.cost == last->cost);
    if (row.on_front) last = &row;
  }
}

std::vector<std::string> FormulationsOf(const std::vector<TradeoffRow>& rows) {
  std::vector<std::string> names;
  for (const TradeoffRow& row : rows) {
    const std::string name = row.record.Text("formulation");
    if (std::ranges::find(names, name) == names.end()) names.push_back(name);
  }
  std::ranges::sort(names);
  return names;
}

/// Rows are in order of cost: the first that will do is the cheapest.
int CheapestOf(const std::vector<TradeoffRow>& rows, const std::string& formulation,
               double error_class) {
  const auto found = std::ranges::find_if(rows, [&](const TradeoffRow& row) {
    return row.reason.empty() && row.error <= error_class &&
           row.record.Text("formulation") == formulation;
  });
  return found == rows.end() ? -1 : static_cast<int>(found - rows.begin());
}

void FindCheapest(const std::vector<double>& classes, TradeoffProblem* problem) {
  const std::vector<TradeoffRow>& rows = problem->rows;
  for (const double error_class : classes) {
    const std::size_t first = problem->cheapest.size();
    double least = std::numeric_limits<double>::infinity();
    for (const std::string& formulation : FormulationsOf(rows)) {
      const int row = CheapestOf(rows, formulation, error_class);
      problem->cheapest.push_back(
          {.error_class = error_class, .formulation = formulation, .row = row});
      if (row >= 0) least = std::min(least, rows[static_cast<std::size_t>(row)].cost);
    }
    for (std::size_t i = first; i < problem->cheapest.size(); ++i) {
      Cheapest& one = problem->cheapest[i];
      if (one.row >= 0) one.ratio = rows[static_cast<std::size_t>(one.row)].cost / least;
    }
  }
}

/// What is no number comes last.
bool IsCheaper(const TradeoffRow& a, const TradeoffRow& b) {
  const auto key = [](double value) {
    return std::isnan(value) ? std::numeric_limits<double>::infinity() : value;
  };
  return std::pair(key(a.cost), key(a.error)) < std::pair(key(b.cost), key(b.error));
}

}  // namespace

std::span<const char* const> UsualErrors() { return kErrors; }

bool IsErrorOfPositions(const std::string& key) {
  return key.starts_with("error_position") || key == "error_shape_max";
}

Tradeoff MakeTradeoff(std::span<const Record> records, const TradeoffOptions& options) {
  for (const std::string& key : options.per) RequireKey("--per", key, records);
  RequireConditions("--where", options.where, records);
  Tradeoff tradeoff;
  tradeoff.error = ErrorKey(records, options, &tradeoff.remarks);
  Timings timings;
  for (const Record& record : records) {
    if (record.Text("kind") == "timing") timings[NameOfCase(record)] = &record;
  }
  tradeoff.cost = CostKey(records, timings, options, &tradeoff.remarks);
  std::vector<Record> runs = Filter(records, {{"kind", {"accuracy"}}});
  SortRows(&runs);  // equal costs stay in the order of tables
  std::map<std::string, std::size_t> places;
  for (const Record& run : runs) {
    TradeoffRow row = MakeRow(run, TimingOf(run, timings), tradeoff);
    if (!Matches(row.record, options.where)) continue;
    const std::string name = NameOfProblem(run, options.per);
    const auto [place, is_new] = places.try_emplace(name, tradeoff.problems.size());
    if (is_new) tradeoff.problems.push_back({.name = name, .rows = {}, .cheapest = {}});
    tradeoff.problems[place->second].rows.push_back(std::move(row));
  }
  if (tradeoff.problems.empty()) {
    throw ConfigError(fmt::format("tradeoff: no accuracy record{}{}",
                                  options.where.empty() ? "" : " matches ", ToText(options.where)));
  }
  for (TradeoffProblem& problem : tradeoff.problems) {
    std::ranges::stable_sort(problem.rows, IsCheaper);
    MarkFront(&problem.rows);
    FindCheapest(options.classes, &problem);
  }
  return tradeoff;
}

}  // namespace loopbench::harness
