#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <optional>
#include <set>
#include <tuple>
#include <utility>

#include "harness/base/text.h"
#include "harness/judge/analysis.h"
#include "harness/judge/judge.h"
#include "harness/judge/tables.h"

namespace loopbench::harness {
namespace {

constexpr const char* kFinishedWord = "finished";

CellState StateOfEnding(const std::string& outcome) {
  const auto known = std::ranges::find(kRunEndings, outcome, &RunEnding::word);
  return known == kRunEndings.end() ? CellState::kBroken : known->state;
}

// Returns the rank of a run; the greatest decides a cell. Stopped runs are ranked by time.
auto SeverityKey(const MapCell& cell) {
  return std::tuple(cell.state, std::isnan(cell.decided.ratio) ? 0.0 : cell.decided.ratio,
                    std::isnan(cell.t_reached) ? 0.0 : -cell.t_reached);
}

Selection RowAndColumn(const Selection& one, const Selection& other) {
  Selection both = one;
  both.insert(both.end(), other.begin(), other.end());
  if (!Contains(both, "kind", &Condition::key)) both.push_back({"kind", {"accuracy"}});
  return both;
}

std::vector<std::string> UnknownKeys(const MapRules& rules, std::span<const Record> records) {
  std::set<std::string> named;
  const auto name = [&named](const Selection& selection) {
    for (const Condition& condition : selection) named.insert(condition.key);
  };
  for (const MapMethod& column : rules.columns) name(column.select);
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
    if (records.empty() || Contains(known, key)) continue;
    const std::string nearest = NearestSpelling(key, known);
    remarks.push_back(fmt::format("no record has the key \"{}\"{}", key,
                                  nearest.empty() ? "" : " (did you mean \"" + nearest + "\"?)"));
  }
  return remarks;
}

// Evaluates a run with an unexpected outcome.
void JudgeEnding(const MapRow& row, const Record& record, MapCell* cell) {
  cell->state = StateOfEnding(cell->outcome);
  cell->word = cell->state == CellState::kInaccurate ? ToString(cell->state) : cell->outcome;
  cell->reason = record.Text("message");
  if (row.right == std::vector<std::string>{kFinishedWord}) return;
  cell->reason =
      fmt::format("ended as {}, right is {}{}{}", cell->outcome, fmt::join(row.right, " or "),
                  cell->reason.empty() ? "" : ": ", cell->reason);
}

/// Evaluates one run.
MapCell JudgeRun(const MapRow& row, const Record& record) {
  MapCell cell;
  cell.outcome = record.Text("outcome");
  cell.case_id = record.Text("case_id");
  cell.t_reached = record.Number("t_reached");
  cell.records = 1;
  if (!Contains(row.right, cell.outcome)) {
    JudgeEnding(row, record, &cell);
    return cell;
  }
  std::string beyond, lacking;
  for (const Demand& demand : row.decides) {
    if (!Contains(demand.when, cell.outcome)) continue;
    const Judged judged = Judge(demand, record);
    if (!judged.measured) {
      lacking = judged.reason;
      continue;
    }
    // the met demand closest to its limit decides, unless a demand is not met
    if (judged.met ? beyond.empty() && !(judged.ratio <= cell.decided.ratio)
                   : beyond.empty() || judged.ratio > cell.decided.ratio) {
      cell.decided = judged;
    }
    if (!judged.met) beyond += (beyond.empty() ? "" : "; ") + judged.reason;
  }
  cell.state = !beyond.empty()    ? CellState::kInaccurate
               : !lacking.empty() ? CellState::kNotMeasured
                                  : CellState::kHolds;
  if (cell.state == CellState::kNotMeasured) cell.decided = {};
  cell.reason = beyond.empty() ? lacking : beyond;
  cell.holding = cell.state == CellState::kHolds ? 1 : 0;
  cell.word = ToString(cell.state);
  return cell;
}

}  // namespace

std::string_view ToString(CellState state) {
  constexpr std::string_view kWords[] = {"holds", "not applicable", "not measured", "stopped",
                                         "limit", "inaccurate",     "broken"};
  return kWords[static_cast<std::size_t>(state)];
}

MapCell JudgeCell(const MapRow& row, std::size_t column, const MapMethod& method,
                  std::span<const Record> records) {
  const Selection selection = RowAndColumn(row.select, method.select);
  std::optional<MapCell> worst;
  std::size_t holding = 0, count = 0, flagged = 0;
  std::vector<std::string> warnings;
  for (const Record& record : records) {
    if (!Matches(record, selection)) continue;
    const MapCell one = JudgeRun(row, record);
    holding += one.holding;
    if (one.holding > 0 && HasWarning(record)) {
      ++flagged;
      std::ranges::move(WarningsOf(record), std::back_inserter(warnings));
    }
    ++count;
    if (!worst || SeverityKey(one) > SeverityKey(*worst)) worst = one;
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
  cell.flagged = flagged;
  cell.warnings = CountWords(warnings);
  cell.cases = std::max(count, row.cases);
  cell.demanded = row.must_hold.at(column);
  return cell;
}

RobustnessMap MakeRobustnessMap(const MapRules& rules, std::span<const Record> records) {
  RobustnessMap map{rules, {}, UnknownKeys(rules, records)};
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

std::string ClassText(const MapCell& cell) {
  const bool named = cell.state == CellState::kHolds && cell.outcome != kFinishedWord;
  return named ? cell.word + ": " + cell.outcome : cell.word;
}

std::string DecidingNumber(const MapCell& cell) {
  if (cell.state == CellState::kNotMeasured || cell.state == CellState::kNotApplicable) return "";
  const Judged& decided = cell.decided;
  if (decided.measure.empty()) {
    if (cell.state == CellState::kInaccurate) return cell.outcome;
    return std::isnan(cell.t_reached) ? "" : fmt::format("at {:.3g} s", cell.t_reached);
  }
  const std::string name = decided.name.empty() ? "" : decided.name + " ";
  const std::string unit = decided.unit.empty() ? "" : " " + decided.unit;
  if (!std::isfinite(decided.value)) return name + "not finite";
  if (std::isnan(decided.total)) return fmt::format("{}{:.2g}{}", name, decided.value, unit);
  return fmt::format("{}{} of {}{}", name, decided.value, decided.total, unit);
}

std::string HoldingCount(const MapCell& cell) {
  const bool several = cell.cases > 1 && cell.records > 0;
  return several ? fmt::format("{}/{}", cell.holding, cell.cases) : "";
}

std::vector<std::string> BrokenDemands(const RobustnessMap& map) {
  std::vector<std::string> broken;
  EachCell(map, [&broken](const MapGroup&, const MapRow& row, const MapMethod& column,
                          const MapCell& cell) {
    if (!cell.demanded || cell.state == CellState::kHolds) return;
    const std::string number = DecidingNumber(cell);
    broken.push_back(fmt::format("{} / {}: {}{}{}{}", column.label, row.label, ClassText(cell),
                                 number.empty() ? "" : " ", number,
                                 cell.reason.empty() ? "" : " (" + cell.reason + ")"));
  });
  return broken;
}

}  // namespace loopbench::harness
