#include "harness/report/report_data.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <set>
#include <string_view>

#include "harness/judge/fairness.h"
#include "harness/record/origin.h"
#include "harness/record/provenance.h"
#include "harness/report/curves.h"
#include "harness/store/result_store.h"
#include "harness/tables/columns.h"
#include "harness/tables/doubt_notes.h"
#include "harness/tables/table_view.h"
#include "harness/text/config_error.h"

namespace loopbench::harness {
namespace {

constexpr std::size_t kRowsNamed = 5;

/// A command as it is typed, whatever its words hold.
std::string Typed(const std::vector<std::string>& words) {
  std::vector<const char*> pointers = {"loopbench"};
  for (const std::string& word : words) pointers.push_back(word.c_str());
  return CommandLine(static_cast<int>(pointers.size()), pointers.data());
}

bool IsBlank(const std::vector<Record>& rows, const TableColumn& column) {
  return std::ranges::all_of(rows, [&](const Record& row) { return Cell(row, column).empty(); });
}

bool IsAlike(const std::vector<Record>& rows, const std::string& key) {
  return std::ranges::all_of(
      rows, [&](const Record& row) { return row.Text(key) == rows.front().Text(key); });
}

/// The table's columns, and what else the records have that has words.
std::vector<TableColumn> AllColumns(const Table& table) {
  std::vector<TableColumn> columns = table.columns;
  std::set<std::string> there;
  for (const TableColumn& column : columns) there.insert(column.key);
  for (const std::string& key : KeysOf(table.rows)) {
    if (key.starts_with("series.") || !there.insert(key).second) continue;
    if (auto column = KnownColumn(key)) columns.push_back(std::move(*column));
  }
  return columns;
}

// Keys that are the same in all rows of a scene and not in all rows: those of the scene.
std::vector<std::string> KeysOfScenes(const std::vector<Record>& rows,
                                      const std::vector<std::string>& telling) {
  std::vector<std::string> keys;
  std::map<std::string, const Record*> first;
  for (const Record& row : rows) {
    first.emplace(row.Text("scene_id") + " " + row.Text("horizon"), &row);
  }
  for (const std::string& key : telling) {
    if (key == "mechanism" || key == "horizon" || key == "experiment") continue;
    const bool is_scenes = first.size() > 1 && std::ranges::all_of(rows, [&](const Record& row) {
                             const Record& other =
                                 *first.at(row.Text("scene_id") + " " + row.Text("horizon"));
                             return row.Text(key) == other.Text(key);
                           });
    if (is_scenes) keys.push_back(key);
  }
  return keys;
}

std::string SceneName(const Record& row, const std::vector<std::string>& keys) {
  std::string name = row.Text("mechanism");
  if (!row.Text("horizon").empty()) name += fmt::format(", {} s", row.Text("horizon"));
  for (const std::string& key : keys) name += fmt::format(", {} {}", key, row.Text(key));
  return name;
}

void NameRows(ReportTable* table) {
  std::vector<std::string> telling = TellingKeys(table->rows);
  const std::vector<std::string> of_scenes = KeysOfScenes(table->rows, telling);
  std::erase_if(telling, [&](const std::string& key) {
    return key == "mechanism" || key == "horizon" ||
           std::ranges::find(of_scenes, key) != of_scenes.end();
  });
  std::map<std::string, std::string> ids;  // of scenes, by name
  for (const Record& row : table->rows) {
    std::string name = SceneName(row, of_scenes);
    const std::string id = row.Text("scene_id");
    if (ids.emplace(name, id).first->second != id) name += fmt::format(" ({})", id.substr(0, 6));
    table->scenes.push_back(name);
    std::string own = NameOfRow(row, telling);
    if (own.empty() || telling.empty()) own = row.Text("formulation");
    table->names.push_back(own);
  }
}

std::vector<ReportTable> MakeTables(const std::vector<Record>& records, const std::string& store) {
  std::vector<ReportTable> tables;
  for (const auto& [kind, title] : {std::pair{"drift", "Accuracy runs"},
                                    {"precision", "Runs in several scalars"},
                                    {"timing", "Timings"}}) {
    Table full = MakeTable(records, {.kind = kind});
    if (full.rows.empty()) continue;
    ReportTable table{.kind = kind, .title = title};
    for (TableColumn& column : AllColumns(full)) {
      if (IsBlank(full.rows, column)) continue;
      if (full.rows.size() > 1 && IsAlike(full.rows, column.key) && column.key != "outcome") {
        table.alike.push_back(column.header + ": " + Cell(full.rows.front(), column));
      } else {
        table.columns.push_back(std::move(column));
      }
    }
    table.rows = std::move(full.rows);
    table.command = Typed({"table", store, "--kind", kind, "--format", "csv"});
    NameRows(&table);
    tables.push_back(std::move(table));
  }
  return tables;
}

/// A finding for each ending other than "finished", and one for each note of doubts.
std::vector<ReportFinding> FindingsOf(const ReportTable& table,
                                      const std::vector<std::string>& doubts) {
  std::map<std::string, std::vector<std::size_t>> endings;
  for (std::size_t i = 0; i < table.rows.size(); ++i) {
    if (HasFailed(table.rows[i])) endings[table.rows[i].Text("outcome")].push_back(i);
  }
  std::vector<ReportFinding> findings;
  for (const auto& [outcome, rows] : endings) {
    std::string text =
        fmt::format("{} of {} runs ended as {}: ", rows.size(), table.rows.size(), outcome);
    for (std::size_t i = 0; i < std::min(rows.size(), kRowsNamed); ++i) {
      const Record& row = table.rows[rows[i]];
      text +=
          fmt::format("{}{}: {}", i == 0 ? "" : "; ", table.scenes[rows[i]], table.names[rows[i]]);
      if (!row.Text("t_reached").empty()) {
        text += fmt::format(" at {:.4g} s", row.Number("t_reached"));
      }
      if (!row.Text("message").empty()) text += fmt::format(" ({})", row.Text("message"));
    }
    if (rows.size() > kRowsNamed) text += fmt::format("; and {} more", rows.size() - kRowsNamed);
    findings.push_back({true, text, "outcome=" + outcome});
  }
  for (const std::string& note : doubts) {
    const std::string code = note.substr(0, note.find(':'));
    if (code.find(' ') == std::string::npos) findings.push_back({false, note, "doubts~" + code});
  }
  return findings;
}

std::vector<ReportCost> MakeCosts(const std::vector<Record>& records, const std::string& store,
                                  std::vector<std::string>* remarks) {
  std::vector<ReportCost> costs;
  for (const char* key : UsualErrors()) {
    const bool is_there = std::ranges::any_of(
        records, [&](const Record& record) { return std::isfinite(record.Number(key)); });
    if (!is_there) continue;
    TradeoffOptions options{.error = key};
    for (const std::string& other : CaseKeysOf(records)) {
      if (other == "content") options.per.push_back(other);
    }
    try {
      ReportCost cost{.tradeoff = MakeTradeoff(records, options)};
      cost.error = ColumnOf(key, records).header;
      cost.cost = ColumnOf(cost.tradeoff.cost, records).header;
      cost.fairness = FairnessStatement(cost.tradeoff);
      cost.command = Typed({"tradeoff", store, "--error", key});
      costs.push_back(std::move(cost));
    } catch (const ConfigError& error) {
      remarks->push_back(fmt::format("work and precision by {}: {}", key, error.what()));
    }
  }
  return costs;
}

/// Who made the records, how many of them each.
std::vector<std::string> OriginsOf(const std::vector<Record>& records) {
  std::map<std::string, std::size_t> counts;
  for (const Record& record : records) {
    const Origin origin = OriginOf(record);
    ++counts[fmt::format("experiment {}, commit {}, {}, {} {}", record.Text("experiment"),
                         origin.commit, origin.machine, origin.compiler, origin.flags)];
  }
  std::vector<std::string> lines;
  for (const auto& [line, count] : counts) {
    lines.push_back(fmt::format("{} record{}: {}", count, count == 1 ? "" : "s", line));
  }
  return lines;
}

void AddPlots(const ReportTable& table, const ReportOptions& options, ReportData* data) {
  data->plots = MakePlots(table.rows, options.most_points);
  for (const ReportPlot& plot : data->plots) {
    if (plot.shown == plot.points) continue;
    data->remarks.push_back(fmt::format(
        "{} against time: {} of {} points of the store are in this page, of each of equal buckets "
        "of a curve the least and the largest",
        plot.title, plot.shown, plot.points));
  }
}

}  // namespace

ReportData MakeReport(const std::vector<Record>& records, const ReportOptions& options) {
  const std::string store = options.store.string();
  ReportData data{.store = store, .tables = MakeTables(records, store)};
  data.origins = OriginsOf(records);
  data.warnings = NoiseWarnings(records);
  data.plot_command = Typed({"plot", store, "--out", "figures"});
  for (const ClaimRule& rule : options.claims) data.claims.push_back(Evaluate(rule, records));
  data.claims_command =
      Typed({"verdict", store, "--claims", options.claims_file.string(), "--out", "verdicts.md"});
  if (options.rules) data.map = MakeFailureMap(*options.rules, records);
  data.map_command = Typed({"map", store, "--rules", options.rules_file.string()});
  if (data.tables.empty() || data.tables.front().kind != "drift") return data;
  const ReportTable& runs = data.tables.front();
  data.runs = runs.rows.size();
  for (const Record& row : runs.rows) {
    data.failed += HasFailed(row) ? 1 : 0;
    data.doubted += IsDoubtful(row, "outcome") ? 1 : 0;
  }
  data.doubts = DoubtNotes(runs.rows, records);
  data.findings = FindingsOf(runs, data.doubts);
  AddPlots(runs, options, &data);
  data.costs = MakeCosts(records, store, &data.remarks);
  data.scenes = FindScenes(runs.rows, runs.names, runs.scenes, StoreFile(options.store),
                           &data.remarks, &data.changed);
  return data;
}

}  // namespace loopbench::harness
