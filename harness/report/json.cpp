#include "harness/report/json.h"

#include <fmt/format.h>

#include <cmath>
#include <map>

#include "harness/config/formulations.h"
#include "harness/tables/columns.h"
#include "harness/tables/doubt_notes.h"
#include "harness/view/json.h"

namespace loopbench::harness {
namespace {

/// JSON knows no number that is not finite: such is a gap.
std::string Exact(double value) { return std::isfinite(value) ? fmt::format("{}", value) : "null"; }
std::string Drawn(double value) {
  return std::isfinite(value) ? fmt::format("{:.5g}", value) : "null";
}

/// Times of one curve stay apart.
std::string Moment(double value) {
  return std::isfinite(value) ? fmt::format("{:.9g}", value) : "null";
}

/// Cells as the tables print them, each text once; numbers besides, for sorting and conditions.
std::string ColumnText(const ReportTable& table, const TableColumn& column, bool is_brief) {
  std::map<std::string, std::size_t> numbers;
  std::vector<std::string> words;
  std::string at = "[", values = "[";
  for (const Record& row : table.rows) {
    const std::string cell = Cell(row, column);
    const auto [place, is_new] = numbers.emplace(cell, words.size());
    if (is_new) words.push_back(cell);
    at += fmt::format("{}{}", at.size() > 1 ? "," : "", place->second);
    if (column.format == Format::kText) continue;
    values += (values.size() > 1 ? "," : "") + Exact(row.Number(column.key));
  }
  return fmt::format(R"({{"key":{},"header":{},"brief":{},"words":{},"at":{}]{}}})",
                     ScriptString(column.key), ScriptString(column.header), is_brief,
                     Strings(words), at,
                     column.format == Format::kText ? "" : ",\"numbers\":" + values + "]");
}

/// Which columns are shown first: those that fit a terminal, and what rows differ in.
bool IsBrief(const ReportTable& table, const std::string& key) {
  const std::vector<TableColumn>& few = table.kind == "timing"      ? CompactTimingColumns()
                                        : table.kind == "precision" ? CompactPrecisionColumns()
                                                                    : CompactDriftColumns();
  if (std::ranges::find(few, key, &TableColumn::key) != few.end()) return true;
  return key == "doubts" || key == "error_position_max";
}

std::string TableText(const ReportTable& table) {
  const std::vector<std::string> telling = TellingKeys(table.rows);
  const auto column = [&](const TableColumn& one) {
    const bool tells = std::ranges::find(telling, one.key) != telling.end();
    return ColumnText(table, one, tells || IsBrief(table, one.key));
  };
  const auto text = [](const char* key) {
    return [key](const Record& row) { return ScriptString(row.Text(key)); };
  };
  return fmt::format(
      R"({{"kind":"{}","title":{},"command":{},"alike":{},"names":{},"scenes":{},"ids":{},"doubts":{},"failed":{},"formulations":{},"absolute":{},"messages":{},"columns":{}}})",
      table.kind, ScriptString(table.title), ScriptString(table.command), Strings(table.alike),
      Strings(table.names), Strings(table.scenes), ListOf(table.rows, text("case_id")),
      ListOf(table.rows, text("doubts")),
      ListOf(table.rows, [](const Record& row) { return HasFailed(row) ? "1" : "0"; }),
      ListOf(table.rows, text("formulation")),
      ListOf(table.rows,
             [](const Record& row) { return row.Text("coordinates") == "absolute" ? "1" : "0"; }),
      ListOf(table.rows, text("message")), ListOf(table.columns, column));
}

/// The CSS variables of each formulation's colours in joint and in absolute coordinates
/// (LookStyle() in html.cpp).
std::string LooksText() {
  std::string text;
  std::size_t number = 0;
  for (const std::string& name : FormulationNames()) {
    text += fmt::format(R"({0}{1}:["--look-{2}","--look-{2}-weak"])", text.empty() ? "" : ",",
                        ScriptString(name), number++);
  }
  return "{" + text + "}";
}

std::string DoubtsText() {
  std::string text;
  for (const auto& [code, meaning] : MeaningsOfDoubts()) {
    text +=
        fmt::format("{}{}:{}", text.empty() ? "" : ",", ScriptString(code), ScriptString(meaning));
  }
  return "{" + text + "}";
}

std::string CurvesText(const ReportPlot& plot) {
  return ListOf(plot.curves, [](const ReportCurve& curve) {
    return fmt::format(R"({{"row":{},"t":{},"y":{}}})", curve.row, ListOf(curve.t, Moment),
                       ListOf(curve.y, Drawn));
  });
}

std::string CostRowText(const TradeoffRow& row, const std::vector<std::string>& keys) {
  return fmt::format(
      R"({{"name":{},"id":{},"formulation":{},"absolute":{},"x":{},"y":{},"bound":{},"front":{},"reason":{}}})",
      ScriptString(NameOfRow(row.record, keys)), ScriptString(row.record.Text("case_id")),
      ScriptString(row.record.Text("formulation")), row.record.Text("coordinates") == "absolute",
      Drawn(row.cost), Drawn(row.error), row.is_bound, row.on_front, ScriptString(row.reason));
}

std::string CostText(const ReportCost& cost) {
  const auto problem = [](const TradeoffProblem& one) {
    std::vector<Record> records;
    for (const TradeoffRow& row : one.rows) records.push_back(row.record);
    const std::vector<std::string> keys = TellingKeys(records);
    return fmt::format(
        R"({{"name":{},"rows":{}}})", ScriptString(one.name),
        ListOf(one.rows, [&](const TradeoffRow& row) { return CostRowText(row, keys); }));
  };
  return fmt::format(
      R"({{"error":{},"cost":{},"command":{},"fairness":{},"remarks":{},"problems":{}}})",
      ScriptString(cost.error), ScriptString(cost.cost), ScriptString(cost.command),
      Strings(cost.fairness), Strings(cost.tradeoff.remarks),
      ListOf(cost.tradeoff.problems, problem));
}

std::string CellText(const MapCell& cell) {
  return fmt::format(
      R"({{"state":"{}","text":{},"number":{},"count":{},"reason":{},"limit":{},"id":{},"holding":{},"records":{},"cases":{},"demanded":{}}})",
      ToString(cell.state), ScriptString(ClassText(cell)), ScriptString(DecidingNumber(cell)),
      ScriptString(HoldingCount(cell)), ScriptString(cell.reason),
      ScriptString(cell.decided.reason), ScriptString(cell.case_id), cell.holding, cell.records,
      cell.cases, cell.demanded);
}

std::string MapText(const FailureMap& map, const std::string& command) {
  std::string groups;
  for (std::size_t g = 0; g < map.cells.size(); ++g) {
    const MapGroup& group = map.rules.groups[g];
    std::string rows;
    for (std::size_t r = 0; r < group.rows.size(); ++r) {
      const MapRow& row = group.rows[r];
      rows += fmt::format(
          R"({}{{"label":{},"why":{},"select":{},"demands":{},"cells":{}}})", r == 0 ? "" : ",",
          ScriptString(row.label), ScriptString(row.why), ScriptString(ToText(row.select)),
          ListOf(row.decides, [](const Demand& one) { return ScriptString(ToText(one)); }),
          ListOf(map.cells[g][r], CellText));
    }
    groups += fmt::format(R"({}{{"label":{},"rows":[{}]}})", g == 0 ? "" : ",",
                          ScriptString(group.label), rows);
  }
  return fmt::format(
      R"({{"title":{},"comment":{},"command":{},"states":{},"columns":{},"remarks":{},"groups":[{}]}})",
      ScriptString(map.rules.title), ScriptString(map.rules.comment), ScriptString(command),
      ListOf(kCellStates, [](CellState state) { return ScriptString(ToString(state)); }),
      ListOf(map.rules.columns, [](const MapColumn& one) { return ScriptString(one.label); }),
      Strings(map.remarks), groups);
}

std::string SceneText(const ReportScene& scene) {
  const bool planar = scene.picture && scene.picture->planar;
  const auto path = [&](const ReportPath& one) {
    return fmt::format(
        R"({{"label":{},"row":{},"times":{},"frames":{}}})", ScriptString(one.label),
        one.row ? std::to_string(*one.row) : "null", ListOf(one.times, Moment),
        ListOf(one.poses, [&](const Poses& poses) { return PosesJson(poses, planar, 7); }));
  };
  return fmt::format(R"({{"name":{},"missing":{},"picture":{},"paths":{}}})",
                     ScriptString(scene.name), ScriptString(scene.missing),
                     scene.picture ? ToJson(*scene.picture) : "null", ListOf(scene.paths, path));
}

}  // namespace

std::vector<DataElement> ToJson(const ReportData& data) {
  std::vector<DataElement> elements = {
      {"tables", fmt::format(R"({{"looks":{},"doubts":{},"tables":{}}})", LooksText(), DoubtsText(),
                             ListOf(data.tables, TableText))},
      {"scenes", ListOf(data.scenes, SceneText)},
      {"costs", ListOf(data.costs, CostText)},
      {"plots", ListOf(data.plots, [](const ReportPlot& plot) {
         return fmt::format(R"({{"name":"{}","title":{},"unit":{}}})", plot.name,
                            ScriptString(plot.title), ScriptString(plot.unit));
       })}};
  if (data.map) elements.push_back({"map", MapText(*data.map, data.map_command)});
  for (const ReportPlot& plot : data.plots) {
    elements.push_back({"curves-" + plot.name, CurvesText(plot)});
  }
  return elements;
}

}  // namespace loopbench::harness
