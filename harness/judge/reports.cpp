#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <iterator>
#include <map>
#include <set>
#include <sstream>
#include <vector>

#include "harness/base/text.h"
#include "harness/judge/judge.h"
#include "harness/judge/tables.h"

namespace loopbench::harness {
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

/// Returns the label as in the file.
std::string Written(const std::string& label) { return FieldsOf(EscapeCsv(label)).front(); }

using Place = std::vector<std::string>;  // group, row, column

}  // namespace

RobustnessMap MapFromCsv(const MapRules& rules, std::string_view csv, const std::string& file) {
  RobustnessMap map = MakeRobustnessMap(rules, {});
  map.remarks.clear();
  std::map<Place, MapCell*> places;
  EachCell(map,
           [&](const MapGroup& group, const MapRow& row, const MapMethod& method, MapCell& cell) {
             places[{Written(group.label), Written(row.label), Written(method.label)}] = &cell;
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
    cell->second->flagged = 0;
    places.erase(cell);
  }
  if (!places.empty()) {
    const Place& place = places.begin()->first;
    throw ConfigError(
        fmt::format("{}: found no \"{}\" of \"{}\" for \"{}\", expected each cell of the rules",
                    file, place[1], place[0], place[2]));
  }
  return map;
}
namespace {

std::string ColumnKey(std::size_t column) { return fmt::format("column{}", column); }

// Returns `text`, the number and the count, if present.
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

// Returns the colour of a cell, whose text begins with its class.
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

// Adds the rows of one group.
void AddMapRows(const RobustnessMap& map, std::size_t group,
                const std::function<std::string(const MapCell&)>& text, Table* table) {
  for (std::size_t r = 0; r < map.cells[group].size(); ++r) {
    Record row;
    row.Set("group", map.rules.groups[group].label);
    row.Set("row", map.rules.groups[group].rows[r].label);
    for (std::size_t c = 0; c < map.rules.columns.size(); ++c) {
      row.Set(ColumnKey(c), text(map.cells[group][r][c]));
    }
    table->rows.push_back(std::move(row));
  }
}

std::vector<TableColumn> MatrixColumns(const RobustnessMap& map, bool letters) {
  std::vector<TableColumn> columns = {{"row", "stress test"}};
  for (std::size_t c = 0; c < map.rules.columns.size(); ++c) {
    columns.push_back({ColumnKey(c), letters ? LetterOf(c) : map.rules.columns[c].label});
  }
  return columns;
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
    holding += cell.state == CellState::kHolds ? 1 : 0;
    flagged += HoldsWithWarnings(cell) ? 1 : 0;
  });
  return fmt::format("{} of {} cells that hold have runs with warnings", flagged, holding);
}

Table MapTable(const RobustnessMap& map) {
  Table table;
  table.title = map.rules.title;
  table.columns = MatrixColumns(map, true);
  table.columns.push_back({"group", "group"});
  table.group = "group";
  table.colour = &MapColour;
  for (std::size_t g = 0; g < map.cells.size(); ++g) AddMapRows(map, g, TerminalCell, &table);
  for (std::size_t c = 0; c < map.rules.columns.size(); ++c) {
    table.notes.push_back(fmt::format("{}  {}", LetterOf(c), map.rules.columns[c].label));
  }
  table.notes.push_back("");
  table.notes.push_back(CountCells(map));
  table.notes.push_back(CountFlagged(map));
  for (const std::string& remark : map.remarks) table.notes.push_back("note: " + remark);
  return table;
}

Table MapCellTable(const RobustnessMap& map) {
  Table table;
  for (const char* key :
       {"group", "row",      "method", "state",   "class",         "outcome", "measure",
        "value", "unit",     "limit",  "ratio",   "t_reached",     "holding", "records",
        "cases", "required", "reason", "case_id", "with_warnings", "warnings"}) {
    table.columns.push_back({key, key, Format::kShortest});
  }
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
    Table table;
    table.title = map.rules.groups[g].label;
    table.columns = MatrixColumns(map, false);
    AddMapRows(
        map, g, [](const MapCell& cell) { return MapCellText(cell, ClassText(cell)); }, &table);
    page += ToMarkdown(table) + "\n";
  }
  page += ToMarkdown(LimitTable(map)) + "\n";
  page += "Reasons and warnings of each cell: `robustness-map.csv`.\n";
  for (const std::string& note : notes) page += "\n" + EscapeMarkdownParagraph(note) + "\n";
  return page;
}
namespace {

constexpr const char* kNobody = "none";

/// Returns green on the front, yellow for warnings, red for failed runs.
std::string FrontColour(const Record& row, const TableColumn& column) {
  if (column.key == "front") return row.Text("front") == "*" ? "32" : "";
  if (column.key != "reason") return "";
  if (HasFailed(row)) return "31";
  return row.Text("warnings").empty() ? "" : "33";
}

/// Returns true for keys that identify a method, not shared by all rows of a problem.
bool NamesMethod(const std::string& key) {
  constexpr std::string_view kOthers[] = {"kind", "experiment", "mechanism", "horizon"};
  return !Contains(kOthers, key);
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
  std::vector<TableColumn> columns;
  for (const std::string& key : CaseKeysOf(records)) {
    if (!NamesMethod(key) || (key == "atol" && AtolFollowsRtol(records))) continue;
    if (compact && key != "formulation" && IsAlike(records, key)) continue;
    const TableColumn column = ColumnOf(key, records);
    columns.push_back(compact ? CompactCaseColumn(key).value_or(column) : column);
  }
  return columns;
}

/// Returns a row of a table: the record with the problem and the results.
Record ShownRow(const WorkPrecisionProblem& problem, const WorkPrecisionRow& row) {
  Record shown = row.record;
  shown.Set("problem", problem.name);
  shown.Set("front", std::string(row.on_front ? "*" : ""));
  shown.Set("error", std::isfinite(row.error) ? Value(row.error) : Value());
  shown.Set("error_is_bound", row.is_bound);
  shown.Set("cost", std::isfinite(row.cost) ? Value(row.cost) : Value());
  shown.Set("reason", row.reason);
  return shown;
}

Format FormatOfCost(const WorkPrecision& work_precision) {
  const Measure* measure = FindMeasure(work_precision.cost);
  return measure == nullptr || measure->heading.words.empty() ? Format::kShortest
                                                              : measure->heading.format;
}

/// Returns the columns of the rows; compact tables have the front first, and no details.
std::vector<TableColumn> RowColumns(const WorkPrecision& work_precision,
                                    const std::vector<Record>& records, bool compact) {
  std::vector<TableColumn> columns = Columns(compact ? "front=" : "problem");
  std::ranges::move(MethodColumns(records, compact), std::back_inserter(columns));
  columns.push_back({"error", WithUnit("error", work_precision.error), Format::kScientific});
  if (!compact) columns.push_back({"error_is_bound", "is bound"});
  columns.push_back({"cost", WithUnit("cost", work_precision.cost), FormatOfCost(work_precision)});
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
  const std::vector<Record> records = RecordsOfRows(work_precision);
  Table table;
  table.title = fmt::format("{} against {}", work_precision.error, work_precision.cost);
  table.group = "problem";
  table.colour = &FrontColour;
  table.columns = RowColumns(work_precision, records, view.compact);
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
  table.notes = work_precision.remarks;
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
  Table table;
  table.title =
      fmt::format("The cheapest method for an error: {}, and its ratio to the cheapest of all",
                  WithUnit(work_precision.cost, work_precision.cost));
  table.columns = {{"problem", "problem"},
                   {"error_class", WithUnit("error <=", work_precision.error), Format::kShortest}};
  for (const std::string& name : names) table.columns.push_back({name, name});
  for (const WorkPrecisionProblem& problem : work_precision.problems) {
    Record* row = nullptr;
    double last = std::numeric_limits<double>::quiet_NaN();
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
  Table table;
  table.title = "The cheapest methods";
  table.columns = {{"problem", "problem"},
                   {"error_class", WithUnit("error <=", work_precision.error), Format::kShortest},
                   {"formulation", "formulation"},
                   {"method", "method"},
                   {"error", WithUnit("error", work_precision.error), Format::kScientific},
                   {"cost", WithUnit("cost", work_precision.cost), FormatOfCost(work_precision)},
                   {"ratio", "to the cheapest", Format::kExponent}};
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
  std::ranges::move(FairnessStatement(work_precision), std::back_inserter(overview.notes));
  Table rows = WorkPrecisionTable(work_precision, {.compact = false, .all = true});
  rows.notes.insert(rows.notes.end(), notes.begin(), notes.end());
  return ToMarkdown(overview) + "\n" + ToMarkdown(CheapestTable(work_precision)) + "\n" +
         ToMarkdown(rows);
}

}  // namespace loopbench::harness
