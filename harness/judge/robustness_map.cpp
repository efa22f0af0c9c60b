// Robustness maps: their cells, tables and documents.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <iterator>
#include <map>
#include <optional>
#include <set>
#include <sstream>
#include <tuple>
#include <vector>

#include "harness/base/text.h"
#include "harness/judge/analysis.h"
#include "harness/judge/judge.h"
#include "harness/judge/tables.h"

namespace loopbench::harness {
namespace {

constexpr const char* kFinishedWord = "finished";

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

/// Returns a sentence for each key of the rules that no record has.
std::vector<std::string> UnknownKeys(const MapRules& rules, std::span<const Record> records) {
  std::set<std::string> named;
  const auto name = [&named](const Selection& selection) {
    for (const Condition& condition : selection) named.insert(condition.key);
  };
  for (const MapMethod& column : rules.columns) name(column.select);
  for (const MapGroup& group : rules.groups) {
    for (const MapRow& row : group.rows) {
      name(row.select);
      for (const Demand& demand : row.decides) named.insert({demand.measure, demand.of});
    }
  }
  named.erase("");  // a demand without a second key
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

void JudgeEnding(const MapRow& row, const Record& record, MapCell* cell) {
  const auto known = std::ranges::find(kRunEndings, cell->outcome, &RunEnding::word);
  cell->state = known == kRunEndings.end() ? CellState::kBroken : known->state;
  cell->word = cell->state == CellState::kInaccurate ? ToString(cell->state) : cell->outcome;
  cell->reason = record.Text("message");
  if (row.right == std::vector<std::string>{kFinishedWord}) return;
  cell->reason =
      fmt::format("ended as {}, right is {}{}{}", cell->outcome, fmt::join(row.right, " or "),
                  cell->reason.empty() ? "" : ": ", cell->reason);
}

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

MapCell JudgeCell(const MapRow& row, std::size_t column, const MapMethod& method,
                  std::span<const Record> records) {
  const Selection selection = RowAndColumn(row.select, method.select);
  std::optional<MapCell> worst;
  MapCell sum;  // of all runs
  std::vector<std::string> warnings;
  for (const Record& record : records) {
    if (!Matches(record, selection)) continue;
    const MapCell one = JudgeRun(row, record);
    ++sum.records;
    sum.holding += one.holding;
    if (one.holding > 0 && HasWarning(record)) {
      ++sum.flagged;
      std::ranges::move(WarningsOf(record), std::back_inserter(warnings));
    }
    if (!worst || SeverityKey(one) > SeverityKey(*worst)) worst = one;
  }
  MapCell cell;
  const auto named = row.not_applicable.find(method.label);
  const std::string excuse = named != row.not_applicable.end() ? named->second
                             : row.must_hold.at(column)        ? ""
                                                               : row.others_not_applicable;
  if (worst && (sum.records >= row.cases || worst->state > CellState::kNotMeasured)) {
    cell = *worst;
  } else if (!worst && !excuse.empty()) {
    cell.state = CellState::kNotApplicable;
    cell.word = ToString(cell.state);
    cell.reason = excuse;
  } else {
    cell.reason = worst ? fmt::format("{} of {} cases have a record", sum.records, row.cases)
                        : "no record matches";
  }
  cell.holding = sum.holding;
  cell.records = sum.records;
  cell.flagged = sum.flagged;
  cell.warnings = CountWords(warnings);
  cell.cases = std::max(sum.records, row.cases);
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

namespace {

/// Returns the fields of a line; quoted fields may have commas and doubled quotes. Texts have no
/// line ends (EscapeCsv).
std::vector<std::string> FieldsOf(std::string_view line) {
  std::vector<std::string> fields(1);
  bool quoted = false;
  for (std::size_t i = 0; i < line.size(); ++i) {
    const char c = line[i];
    if (c == '"' && quoted && i + 1 < line.size() && line[i + 1] == '"') {
      fields.back() += line[++i];
    } else if (c == '"') {
      quoted = !quoted;
    } else if (c == ',' && !quoted) {
      fields.emplace_back();
    } else if (c != '\r') {
      fields.back() += c;
    }
  }
  return fields;
}

using Place = std::vector<std::string>;  // group, row, column

}  // namespace

RobustnessMap MapFromCsv(const MapRules& rules, std::string_view csv, const std::string& file) {
  RobustnessMap map = MakeRobustnessMap(rules, {});
  map.remarks.clear();
  std::map<Place, MapCell*> places;
  EachCell(map,
           [&](const MapGroup& group, const MapRow& row, const MapMethod& method, MapCell& cell) {
             const auto written = [](const std::string& label) {
               return FieldsOf(EscapeCsv(label)).front();
             };
             places[{written(group.label), written(row.label), written(method.label)}] = &cell;
           });
  std::vector<std::string> heading;
  std::size_t number = 0;
  const auto fail = [&](const std::string& found, const char* expected) {
    throw ConfigError(fmt::format("{}:{}: found {}, expected {}", file, number, found, expected));
  };
  std::istringstream lines{std::string(csv)};
  for (std::string line; std::getline(lines, line);) {
    ++number;
    if (line.empty() || line.front() == '#') continue;
    const std::vector<std::string> fields = FieldsOf(line);
    if (heading.empty()) {
      heading = fields;
      continue;
    }
    if (fields.size() != heading.size()) {
      fail(fmt::format("{} fields", fields.size()), "as many as in the heading");
    }
    const auto field = [&](const char* key) {
      const auto at = std::ranges::find(heading, key);
      if (at == heading.end()) {
        fail(fmt::format("no column \"{}\"", key),
             "robustness-map.csv of \"loopbench robustness\"");
      }
      return fields[static_cast<std::size_t>(at - heading.begin())];
    };
    const auto cell = places.find({field("group"), field("row"), field("method")});
    if (cell == places.end()) {
      fail(
          fmt::format("\"{}\" of \"{}\" for \"{}\"", field("row"), field("group"), field("method")),
          "each cell of the rules once");
    }
    const auto* state =
        std::ranges::find(kCellStates, field("state"), [](CellState one) { return ToString(one); });
    if (state == kCellStates.end()) {
      fail(fmt::format("state \"{}\"", field("state")), "a state of cells");
    }
    cell->second->state = *state;
    cell->second->demanded = field("required") == "true";
    places.erase(cell);
  }
  if (places.empty()) return map;
  const Place& place = places.begin()->first;
  throw ConfigError(
      fmt::format("{}: found no \"{}\" of \"{}\" for \"{}\", expected each cell of the rules", file,
                  place[1], place[0], place[2]));
}

namespace {

std::string ColumnKey(std::size_t column) { return fmt::format("column{}", column); }

std::string MapCellText(const MapCell& cell, std::string text) {
  for (const std::string& part : {DecidingNumber(cell), HoldingCount(cell)}) {
    if (!part.empty()) text += " " + part;
  }
  return text;
}

// Returns a short cell for terminals: numbers without names and units, methods by letter.
std::string TerminalCell(const MapCell& cell) {
  if (cell.state == CellState::kNotApplicable) return "-";
  MapCell plain = cell;
  plain.decided.name = plain.decided.unit = "";
  if (cell.state == CellState::kNotMeasured) return MapCellText(plain, "?");
  if (cell.state != CellState::kHolds) return MapCellText(plain, cell.word);
  return MapCellText(plain, ClassText(cell) == "holds" ? "ok" : "ok: " + cell.outcome);
}

std::string MapColour(const Record& row, const TableColumn& column) {
  const std::string text = row.Text(column.key);
  const std::string word = text.substr(0, text.find(' '));
  for (const RunEnding& ending : kRunEndings) {
    if (word != ending.word) continue;
    return ending.state == CellState::kStopped ? "33"  // yellow
           : ending.state == CellState::kLimit ? "35"  // magenta
                                               : "1;31";
  }
  if (word == "inaccurate") return "31";
  return word == "ok" || word == "ok:" ? "32" : "";
}

/// Returns a table of one group, or of all: a row per stress test, with these texts of cells.
Table Matrix(const RobustnessMap& map, std::optional<std::size_t> group,
             const std::function<std::string(const MapCell&)>& text) {
  Table table{.title = group ? map.rules.groups[*group].label : map.rules.title,
              .columns = Columns("row=stress test")};
  for (std::size_t c = 0; c < map.rules.columns.size(); ++c) {
    table.columns.push_back({ColumnKey(c), group ? map.rules.columns[c].label : LetterOf(c)});
  }
  for (std::size_t g = group.value_or(0); g < (group ? *group + 1 : map.cells.size()); ++g) {
    for (std::size_t r = 0; r < map.cells[g].size(); ++r) {
      Record& row = table.rows.emplace_back();
      row.Set("group", map.rules.groups[g].label);
      row.Set("row", map.rules.groups[g].rows[r].label);
      for (std::size_t c = 0; c < map.rules.columns.size(); ++c) {
        row.Set(ColumnKey(c), text(map.cells[g][r][c]));
      }
    }
  }
  return table;
}

Table LimitTable(const RobustnessMap& map) {
  Table table{.title = "Limits",
              .columns = Columns("row=stress test, right=expected outcome, demands=criteria, why")};
  const auto text = [](const Demand& demand) { return ToText(demand); };
  for (const MapGroup& group : map.rules.groups) {
    for (const MapRow& row : group.rows) {
      AddRow({row.label, Joined(row.right, " or "), Joined(row.decides, "; ", text), row.why},
             &table);
    }
  }
  return table;
}

/// Returns "24 cells: 15 holds, 3 stopped, 1 inaccurate, 5 not measured".
std::string CountCells(const RobustnessMap& map) {
  std::map<CellState, std::size_t> counts;
  std::size_t total = 0;
  EachCell(map, [&](const MapGroup&, const MapRow&, const MapMethod&, const MapCell& cell) {
    ++counts[cell.state];
    ++total;
  });
  std::vector<std::string> texts;
  for (const CellState state : kCellStates) {
    if (counts[state] > 0) texts.push_back(fmt::format(" {} {}", counts[state], ToString(state)));
  }
  return WithCount(total, "cell") + ":" + Joined(texts, ",");
}

}  // namespace

std::string CountFlagged(const RobustnessMap& map) {
  std::size_t holding = 0, flagged = 0;
  EachCell(map, [&](const MapGroup&, const MapRow&, const MapMethod&, const MapCell& cell) {
    holding += cell.state == CellState::kHolds;
    flagged += cell.HoldsWithWarnings();
  });
  return fmt::format("{} of {} cells that hold have runs with warnings", flagged, holding);
}

Table MapTable(const RobustnessMap& map) {
  Table table = Matrix(map, std::nullopt, TerminalCell);
  table.columns.push_back({"group", "group"});
  table.group = "group";
  table.colour = &MapColour;
  for (std::size_t c = 0; c < map.rules.columns.size(); ++c) {
    table.notes.push_back(fmt::format("{}  {}", LetterOf(c), map.rules.columns[c].label));
  }
  table.AddNotes({"", CountCells(map), CountFlagged(map)});
  for (const std::string& remark : map.remarks) table.notes.push_back("note: " + remark);
  return table;
}

Table MapCellTable(const RobustnessMap& map) {
  Table table{.columns = Columns(
                  "group, row, method, state, class, outcome, measure, value, unit, limit, ratio, "
                  "t_reached, holding, records, cases, required, reason, case_id, with_warnings, "
                  "warnings")};
  EachCell(map, [&](const MapGroup& group, const MapRow& row, const MapMethod& column,
                    const MapCell& cell) {
    const Judged& decided = cell.decided;
    AddRow({group.label,   row.label,       column.label,  cell.state,   cell.word,
            cell.outcome,  decided.measure, decided.value, decided.unit, decided.limit,
            decided.ratio, cell.t_reached,  cell.holding,  cell.records, cell.cases,
            cell.demanded, cell.reason,     cell.case_id,  cell.flagged, cell.warnings},
           &table);
  });
  return table;
}

std::string MapMarkdown(const RobustnessMap& map, const std::vector<std::string>& notes) {
  std::string page = fmt::format("# {}\n\n", EscapeMarkdown(map.rules.title));
  if (!map.rules.comment.empty()) page += EscapeMarkdownParagraph(map.rules.comment) + "\n\n";
  page += CountCells(map) + ". " + CountFlagged(map) + ".\n\n";
  for (const std::string& remark : map.remarks) {
    page += "Note: " + EscapeMarkdown(remark) + ".\n\n";
  }
  for (std::size_t g = 0; g < map.cells.size(); ++g) {
    const auto text = [](const MapCell& cell) { return MapCellText(cell, ClassText(cell)); };
    page += ToMarkdown(Matrix(map, g, text)) + "\n";
  }
  page += ToMarkdown(LimitTable(map)) + "\n";
  page += "Reasons and warnings of each cell: `robustness-map.csv`.\n";
  for (const std::string& note : notes) page += "\n" + EscapeMarkdownParagraph(note) + "\n";
  return page;
}

}  // namespace loopbench::harness
