#include "harness/judge/tradeoff_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "harness/judge/fairness.h"
#include "harness/tables/columns.h"

namespace loopbench::harness {
namespace {

constexpr const char* kNobody = "none reached it";

/// Green on the front, yellow in doubt, red where the run failed.
std::string FrontColour(const Record& row, const TableColumn& column) {
  if (column.key == "front") return row.Text("front") == "*" ? "32" : "";
  if (column.key != "reason") return "";
  if (HasFailed(row)) return "31";
  return row.Text("doubts").empty() ? "" : "33";
}

/// Keys that name the cases of a problem: not what all rows of it share.
bool NamesMethod(const std::string& key) {
  static const std::set<std::string> others = {"kind", "experiment", "mechanism", "horizon",
                                               "atol"};
  return !others.contains(key);
}

std::vector<Record> RecordsOfRows(const Tradeoff& tradeoff) {
  std::vector<Record> records;
  for (const TradeoffProblem& problem : tradeoff.problems) {
    for (const TradeoffRow& row : problem.rows) records.push_back(row.record);
  }
  return records;
}

bool IsAlike(const std::vector<Record>& records, const std::string& key) {
  return std::ranges::all_of(
      records, [&](const Record& record) { return record.Text(key) == records.front().Text(key); });
}

/// The columns that name methods: with short words where the terminal's tables have them, and
/// without those in which no row differs, unless it is the formulation; or all.
std::vector<TableColumn> MethodColumns(const std::vector<Record>& records, bool compact) {
  std::vector<TableColumn> columns;
  for (const std::string& key : CaseKeysOf(records)) {
    if (!NamesMethod(key)) continue;
    if (compact && key != "formulation" && IsAlike(records, key)) continue;
    TableColumn column = ColumnOf(key, records);
    const std::vector<TableColumn>& known = CompactCaseColumns();
    const auto brief = std::ranges::find(known, key, &TableColumn::key);
    if (compact && brief != known.end()) column = *brief;
    columns.push_back(column);
  }
  return columns;
}

/// The row of a table: the record with the problem and what was made of it.
Record ShownRow(const TradeoffProblem& problem, const TradeoffRow& row) {
  Record shown = row.record;
  shown.Set("problem", problem.name);
  shown.Set("front", std::string(row.on_front ? "*" : ""));
  shown.Set("error", std::isfinite(row.error) ? Value(row.error) : Value());
  shown.Set("error_is_bound", row.is_bound);
  shown.Set("cost", std::isfinite(row.cost) ? Value(row.cost) : Value());
  shown.Set("reason", row.reason);
  return shown;
}

std::string UnitOfKey(const std::string& key) { return UnitOf(ColumnOf(key, {})); }

std::string WithUnit(const std::string& words, const std::string& key) {
  const std::string unit = UnitOfKey(key);
  return unit.empty() ? words : fmt::format("{} [{}]", words, unit);
}

Format FormatOfCost(const Tradeoff& tradeoff) {
  const Measure* measure = FindMeasure(tradeoff.cost);
  return measure == nullptr || measure->heading.words.empty() ? Format::kShortest
                                                              : measure->heading.format;
}

std::vector<TableColumn> FullColumns(const Tradeoff& tradeoff, const std::vector<Record>& records) {
  std::vector<TableColumn> columns = {{"problem", "problem"}};
  for (TableColumn& column : MethodColumns(records, false)) columns.push_back(std::move(column));
  columns.push_back({"error", WithUnit("error", tradeoff.error), Format::kScientific});
  columns.push_back({"error_is_bound", "is bound"});
  columns.push_back({"cost", WithUnit("cost", tradeoff.cost), FormatOfCost(tradeoff)});
  columns.push_back({"front", "front"});
  for (const char* key : {"outcome", "doubts", "reference_error", "trust_horizon", "steps",
                          "rejected", "rhs_evaluations", "aa_spread_wall"}) {
    if (std::ranges::any_of(records, [&](const Record& one) { return one.Find(key) != nullptr; })) {
      columns.push_back(ColumnOf(key, records));
    }
  }
  columns.push_back({"reason", "not compared because"});
  return columns;
}

std::vector<TableColumn> FrontColumns(const Tradeoff& tradeoff,
                                      const std::vector<Record>& records) {
  std::vector<TableColumn> columns = {{"front", ""}};
  for (TableColumn& column : MethodColumns(records, true)) columns.push_back(std::move(column));
  columns.push_back({"error", WithUnit("error", tradeoff.error), Format::kScientific});
  columns.push_back({"cost", WithUnit("cost", tradeoff.cost), FormatOfCost(tradeoff)});
  columns.push_back({"reason", "not compared because"});
  return columns;
}

/// "accel joint ode45 1e-06": the method within a formulation, by what tells rows apart.
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

const TradeoffRow& RowOf(const TradeoffProblem& problem, const Cheapest& one) {
  return problem.rows[static_cast<std::size_t>(one.row)];
}

std::vector<std::string> FormulationsOfAll(const Tradeoff& tradeoff) {
  std::set<std::string> names;
  for (const TradeoffProblem& problem : tradeoff.problems) {
    for (const Cheapest& one : problem.cheapest) names.insert(one.formulation);
  }
  return {names.begin(), names.end()};
}

}  // namespace

Table TradeoffTable(const Tradeoff& tradeoff, const TradeoffView& view) {
  const std::vector<Record> records = RecordsOfRows(tradeoff);
  Table table;
  table.title = fmt::format("{} against {}", tradeoff.error, tradeoff.cost);
  table.group = "problem";
  table.colour = &FrontColour;
  table.columns = view.compact ? FrontColumns(tradeoff, records) : FullColumns(tradeoff, records);
  std::size_t hidden = 0;
  for (const TradeoffProblem& problem : tradeoff.problems) {
    for (const TradeoffRow& row : problem.rows) {
      if (view.all || row.on_front || !row.reason.empty()) {
        table.rows.push_back(ShownRow(problem, row));
      } else {
        ++hidden;
      }
    }
  }
  table.notes = tradeoff.remarks;
  table.notes.push_back(
      "* on the Pareto front: no compared row is better in one and as good in the other");
  if (hidden > 0) {
    table.notes.push_back(fmt::format("{} more row{} compared and beaten (--all shows them)",
                                      hidden, hidden == 1 ? " was" : "s were"));
  }
  return table;
}

Table OverviewTable(const Tradeoff& tradeoff) {
  Table table;
  table.title =
      fmt::format("The cheapest method for an error: {}, and its ratio to the cheapest of all",
                  WithUnit(tradeoff.cost, tradeoff.cost));
  table.columns = {{"problem", "problem"},
                   {"error_class", WithUnit("error <=", tradeoff.error), Format::kShortest}};
  for (const std::string& name : FormulationsOfAll(tradeoff)) table.columns.push_back({name, name});
  for (const TradeoffProblem& problem : tradeoff.problems) {
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

Table CheapestTable(const Tradeoff& tradeoff) {
  const std::vector<TableColumn> naming = MethodColumns(RecordsOfRows(tradeoff), true);
  Table table;
  table.title = "The cheapest methods";
  table.columns = {{"problem", "problem"},
                   {"error_class", WithUnit("error <=", tradeoff.error), Format::kShortest},
                   {"formulation", "formulation"},
                   {"method", "method"},
                   {"error", WithUnit("error", tradeoff.error), Format::kScientific},
                   {"cost", WithUnit("cost", tradeoff.cost), FormatOfCost(tradeoff)},
                   {"ratio", "to the cheapest", Format::kExponent}};
  for (const TradeoffProblem& problem : tradeoff.problems) {
    for (const Cheapest& one : problem.cheapest) {
      if (one.row < 0) {
        AddRow({problem.name, one.error_class, one.formulation, std::string(kNobody)}, &table);
        continue;
      }
      const TradeoffRow& row = RowOf(problem, one);
      AddRow({problem.name, one.error_class, one.formulation, MethodText(row.record, naming),
              row.error, row.cost, one.ratio},
             &table);
    }
  }
  return table;
}

std::string TradeoffMarkdown(const Tradeoff& tradeoff, const std::vector<std::string>& notes) {
  Table overview = OverviewTable(tradeoff);
  overview.notes = tradeoff.remarks;
  for (std::string& line : FairnessStatement(tradeoff)) overview.notes.push_back(std::move(line));
  Table rows = TradeoffTable(tradeoff, {.compact = false, .all = true});
  rows.notes.insert(rows.notes.end(), notes.begin(), notes.end());
  return ToMarkdown(overview) + "\n" + ToMarkdown(CheapestTable(tradeoff)) + "\n" +
         ToMarkdown(rows);
}

}  // namespace loopbench::harness
