#include "harness/judge/failure_map.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <optional>
#include <set>
#include <tuple>

#include "harness/json/spelling.h"
#include "harness/tables/columns.h"

namespace loopbench::harness {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr const char* kFinishedWord = "finished";

constexpr std::array kRunEndings = {RunEnding{"finished", CellState::kInaccurate},
                                    RunEnding{"singular", CellState::kStopped},
                                    RunEnding{"step-too-small", CellState::kStopped},
                                    RunEnding{"non-finite", CellState::kStopped},
                                    RunEnding{"inconsistent-start", CellState::kStopped},
                                    RunEnding{"inconsistent-motion", CellState::kStopped},
                                    RunEnding{"locked", CellState::kStopped},
                                    RunEnding{"newton-failure", CellState::kStopped},
                                    RunEnding{"step-limit", CellState::kLimit},
                                    RunEnding{"time-limit", CellState::kLimit},
                                    RunEnding{"process-time-limit", CellState::kLimit},
                                    RunEnding{"memory-limit", CellState::kLimit},
                                    RunEnding{"integrator-error", CellState::kBroken},
                                    RunEnding{"crashed", CellState::kBroken},
                                    RunEnding{"bad-answer", CellState::kBroken}};

bool Names(const std::vector<std::string>& words, const std::string& word) {
  return std::ranges::find(words, word) != words.end();
}

CellState StateOfEnding(const std::string& outcome) {
  const auto known = std::ranges::find(kRunEndings, outcome, &RunEnding::word);
  return known == kRunEndings.end() ? CellState::kBroken : known->state;
}

// One demand against one record.
struct Met {
  bool measured = false, met = false;
  double value = 0.0, limit = 0.0, ratio = kInfinity;
};

Met Hold(const Demand& demand, const Record& record) {
  Met result;
  const double unit = demand.of.empty() ? 1.0 : record.Number(demand.of);
  result.measured = record.Find(demand.measure) != nullptr && std::isfinite(unit);
  result.value = record.Number(demand.measure);
  result.limit = demand.number * unit;
  if (!result.measured || !std::isfinite(result.value)) return result;
  switch (demand.kind) {
    case Demand::Kind::kAtMost:
      result.met = result.value <= result.limit;
      result.ratio = result.value / result.limit;
      break;
    case Demand::Kind::kAtLeast:
      result.met = result.value >= result.limit;
      if (result.value > 0.0) result.ratio = result.limit / result.value;
      break;
    case Demand::Kind::kEqual:
      result.met = result.value == result.limit;
      result.ratio = result.met ? 0.0 : kInfinity;
      break;
  }
  return result;
}

void SetDecision(const Demand& demand, const Met& met, MapCell* cell) {
  cell->measure = demand.measure;
  cell->name = demand.name;
  cell->unit = demand.unit;
  cell->value = met.value;
  cell->limit = met.limit;
  cell->ratio = met.ratio;
  cell->total = demand.of.empty() || demand.kind == Demand::Kind::kAtMost
                    ? std::numeric_limits<double>::quiet_NaN()
                    : met.limit / demand.number;
}

// "energy_error_max = 0.016 [J], limit 5e-06".
std::string Found(const Demand& demand, const Met& met) {
  constexpr std::array kLimits = {"limit", "at least", "expected"};
  return fmt::format("{} = {}{}, {} {:.3g}", demand.measure,
                     std::isfinite(met.value) ? fmt::format("{:.3g}", met.value) : "not finite",
                     demand.unit.empty() ? "" : " [" + demand.unit + "]",
                     kLimits.at(static_cast<std::size_t>(demand.kind)), met.limit);
}

// Which of two judgements decides a cell: the greater one. Runs that stopped compare by when.
auto Badness(const MapCell& cell) {
  return std::tuple(cell.state, std::isnan(cell.ratio) ? 0.0 : cell.ratio,
                    std::isnan(cell.t_reached) ? 0.0 : -cell.t_reached);
}

Selection RowAndColumn(const Selection& one, const Selection& other) {
  Selection both = one;
  both.insert(both.end(), other.begin(), other.end());
  if (std::ranges::find(both, "kind", &Condition::key) == both.end()) {
    both.push_back({"kind", {"accuracy"}});
  }
  return both;
}

std::vector<std::string> UnknownKeys(const MapRules& rules, std::span<const Record> records) {
  std::set<std::string> named;
  const auto name = [&named](const Selection& selection) {
    for (const Condition& condition : selection) named.insert(condition.key);
  };
  for (const MapColumn& column : rules.columns) name(column.select);
  for (const MapGroup& group : rules.groups) {
    for (const MapRow& row : group.rows) {
      name(row.select);
      for (const Demand& demand : row.decides) {
        named.insert(demand.measure);
        if (!demand.of.empty()) named.insert(demand.of);
      }
    }
  }
  const std::vector<std::string> known = KeysOf(records);
  std::vector<std::string> remarks;
  for (const std::string& key : named) {
    if (records.empty() || Names(known, key)) continue;
    const std::string nearest = NearestSpelling(key, known);
    remarks.push_back(fmt::format("no record has the key \"{}\"{}", key,
                                  nearest.empty() ? "" : " (did you mean \"" + nearest + "\"?)"));
  }
  return remarks;
}

}  // namespace

std::string_view ToString(CellState state) {
  switch (state) {
    case CellState::kHolds:
      return "holds";
    case CellState::kNotApplicable:
      return "not applicable";
    case CellState::kNotMeasured:
      break;
    case CellState::kStopped:
      return "stopped";
    case CellState::kLimit:
      return "limit";
    case CellState::kInaccurate:
      return "inaccurate";
    case CellState::kBroken:
      return "broken";
  }
  return "not measured";
}

std::span<const RunEnding> RunEndings() { return kRunEndings; }

MapCell JudgeRun(const MapRow& row, const Record& record) {
  MapCell cell;
  cell.outcome = record.Text("outcome");
  cell.case_id = record.Text("case_id");
  cell.t_reached = record.Number("t_reached");
  cell.records = 1;
  if (!Names(row.right, cell.outcome)) {
    cell.state = StateOfEnding(cell.outcome);
    cell.word = cell.state == CellState::kInaccurate ? ToString(cell.state) : cell.outcome;
    cell.reason = record.Text("message");
    if (row.right != std::vector<std::string>{kFinishedWord}) {
      cell.reason =
          fmt::format("ended as {}, right is {}{}{}", cell.outcome, fmt::join(row.right, " or "),
                      cell.reason.empty() ? "" : ": ", cell.reason);
    }
    return cell;
  }
  cell.state = CellState::kHolds;
  MapCell unmeasured = cell;
  std::string beyond;
  for (const Demand& demand : row.decides) {
    if (!Names(demand.when, cell.outcome)) continue;
    const Met met = Hold(demand, record);
    if (!met.measured) {
      unmeasured.state = CellState::kNotMeasured;
      unmeasured.reason =
          "the record has no " +
          (record.Find(demand.measure) == nullptr ? demand.measure : "finite " + demand.of);
    } else if (!met.met) {
      beyond += (beyond.empty() ? "" : "; ") + Found(demand, met);
      if (cell.state == CellState::kHolds || met.ratio > cell.ratio) {
        SetDecision(demand, met, &cell);
      }
      cell.state = CellState::kInaccurate;
    } else if (met.met && cell.state == CellState::kHolds && !(met.ratio <= cell.ratio)) {
      SetDecision(demand, met, &cell);
    }
  }
  if (cell.state == CellState::kHolds && unmeasured.state != cell.state) cell = unmeasured;
  cell.reason += beyond;
  cell.holding = cell.state == CellState::kHolds ? 1 : 0;
  cell.word = ToString(cell.state);
  return cell;
}

MapCell JudgeCell(const MapRow& row, std::size_t column, const MapColumn& method,
                  std::span<const Record> records) {
  const Selection selection = RowAndColumn(row.select, method.select);
  std::optional<MapCell> worst;
  std::size_t holding = 0, count = 0;
  for (const Record& record : records) {
    if (!Matches(record, selection)) continue;
    const MapCell one = JudgeRun(row, record);
    holding += one.holding;
    ++count;
    if (!worst || Badness(one) > Badness(*worst)) worst = one;
  }
  MapCell cell;
  const auto named = row.not_applicable.find(method.label);
  const std::string excuse = named != row.not_applicable.end() ? named->second
                             : row.must_hold.at(column)        ? ""
                                                               : row.others_not_applicable;
  if (worst && (count >= row.cases || worst->state > CellState::kNotMeasured)) {
    cell = *worst;
  } else if (!worst && !excuse.empty()) {
    cell.state = CellState::kNotApplicable;
    cell.word = ToString(cell.state);
    cell.reason = excuse;
  } else {
    cell.reason =
        worst ? fmt::format("{} of {} cases have a record", count, row.cases) : "no record matches";
  }
  cell.holding = holding;
  cell.records = count;
  cell.cases = std::max(count, row.cases);
  cell.demanded = row.must_hold.at(column);
  return cell;
}

FailureMap MakeFailureMap(const MapRules& rules, std::span<const Record> records) {
  FailureMap map{rules, {}, UnknownKeys(rules, records)};
  for (const MapGroup& group : rules.groups) {
    auto& rows = map.cells.emplace_back();
    for (const MapRow& row : group.rows) {
      auto& cells = rows.emplace_back();
      for (std::size_t c = 0; c < rules.columns.size(); ++c) {
        cells.push_back(JudgeCell(row, c, rules.columns[c], records));
      }
    }
  }
  return map;
}

std::string ToText(const Demand& demand) {
  constexpr std::array kSigns = {"<=", ">=", "="};
  return fmt::format("{} {} {}{}{}{}", demand.measure,
                     kSigns.at(static_cast<std::size_t>(demand.kind)), demand.number,
                     demand.of.empty() ? "" : " " + demand.of,
                     demand.unit.empty() ? "" : " [" + demand.unit + "]",
                     demand.when == std::vector<std::string>{kFinishedWord}
                         ? ""
                         : fmt::format(" when {}", fmt::join(demand.when, " or ")));
}

std::string ClassText(const MapCell& cell) {
  const bool named = cell.state == CellState::kHolds && cell.outcome != kFinishedWord;
  return named ? cell.word + ": " + cell.outcome : cell.word;
}

std::string DecidingNumber(const MapCell& cell) {
  const std::string name = cell.name.empty() ? "" : cell.name + " ";
  const std::string unit = cell.unit.empty() ? "" : " " + cell.unit;
  if (cell.state == CellState::kNotMeasured || cell.state == CellState::kNotApplicable) return "";
  if (cell.measure.empty()) {
    if (cell.state == CellState::kInaccurate) return cell.outcome;
    if (std::isnan(cell.t_reached)) return "";
    return fmt::format("at {:.3g} s", cell.t_reached);
  }
  if (!std::isfinite(cell.value)) return name + "not finite";
  if (!std::isnan(cell.total))
    return fmt::format("{}{} of {}{}", name, cell.value, cell.total, unit);
  return fmt::format("{}{:.2g}{}", name, cell.value, unit);
}

std::string HoldingCount(const MapCell& cell) {
  const bool several = cell.cases > 1 && cell.records > 0;
  return several ? fmt::format("{}/{}", cell.holding, cell.cases) : "";
}

std::vector<std::string> BrokenDemands(const FailureMap& map) {
  std::vector<std::string> broken;
  for (std::size_t g = 0; g < map.cells.size(); ++g) {
    for (std::size_t r = 0; r < map.cells[g].size(); ++r) {
      for (std::size_t c = 0; c < map.rules.columns.size(); ++c) {
        const MapCell& cell = map.cells[g][r][c];
        if (!cell.demanded || cell.state == CellState::kHolds) continue;
        const std::string number = DecidingNumber(cell);
        broken.push_back(fmt::format("{} / {}: {}{}{}{}", map.rules.columns[c].label,
                                     map.rules.groups[g].rows[r].label, ClassText(cell),
                                     number.empty() ? "" : " ", number,
                                     cell.reason.empty() ? "" : " (" + cell.reason + ")"));
      }
    }
  }
  return broken;
}

}  // namespace loopbench::harness
