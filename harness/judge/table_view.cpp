#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <optional>
#include <tuple>

#include "harness/base/record.h"
#include "harness/base/text.h"
#include "harness/config/experiment.h"
#include "harness/config/formulations.h"
#include "harness/judge/tables.h"

namespace loopbench::harness {
namespace {

// Identity of a run at fixed tolerance and horizon. "geometry" is "square", "general" or, for a
// problem without counterpart, empty; "family" is then the problem's own name.
using Key = std::map<std::string, std::string>;

struct Run {
  Key key;
  Record record;
};

void SetProblem(const std::string& mechanism, const FactorialOptions& options, Key* key) {
  (*key)["family"] = mechanism;
  (*key)["geometry"] = "";
  for (const auto& [square, general] : options.square_and_general) {
    if (mechanism != square && mechanism != general) continue;
    (*key)["family"] = square + " | " + general;
    (*key)["geometry"] = mechanism == square ? "square" : "general";
  }
}

// Throws if runs differ in any other key: a table with one effect per factor has no place for both.
void RequireSameCase(const Record& one, const Record& other) {
  if (one.Text("case_id") == other.Text("case_id")) return;
  for (const char* key : {"experiment", "jacobian", "atol", "config_hash", "case_id"}) {
    if (one.Text(key) == other.Text(key)) continue;
    throw ConfigError(fmt::format(
        "factorial table: found {} {} with {} {} and {}, expected one of them: choose "
        "with --where {}=...",
        one.Text("mechanism"), one.Text("formulation"), key, one.Text(key), other.Text(key), key));
  }
}

std::vector<Run> Collect(std::span<const Record> records, const FactorialOptions& options) {
  const std::vector<TableColumn> parameters = WithParameters({}, records);
  std::map<Key, Record> last;
  for (const Record& record : records) {
    if (record.Number("rtol") != options.rtol) continue;
    if (record.Number("horizon") != options.horizon) continue;
    // timing has no drift; a run that failed before its first step has only an outcome
    const std::string outcome = record.Text("outcome");
    const bool failed = !outcome.empty() && outcome != "finished";
    if (record.Find("drift_position_max") == nullptr && !failed) continue;
    Key key;
    for (const char* name : {"formulation", "enforcement", "coordinates", "solver", "integrator"}) {
      key[name] = record.Text(name);
    }
    for (const TableColumn& parameter : parameters) {
      // mechanisms differ in content and are still compared
      if (parameter.key == "config_hash" || parameter.key == "set") continue;
      key["parameter " + parameter.key] = record.Text(parameter.key);
    }
    SetProblem(record.Text("mechanism"), options, &key);
    const auto [known, is_new] = last.try_emplace(key, record);
    if (!is_new) RequireSameCase(known->second, record);
    known->second = record;
  }
  std::vector<Run> runs;
  for (const auto& [key, record] : last) runs.push_back({key, record});
  return runs;
}

double Drift(const Record& record) {
  const std::string outcome = record.Text("outcome");
  if (!outcome.empty() && outcome != "finished") return std::numeric_limits<double>::quiet_NaN();
  return std::max(record.Number("drift_position_max"), std::numeric_limits<double>::epsilon());
}

// Sums over the pairs of one row.
struct Row {
  int pairs = 0;
  int left_out = 0;
  double log_sum = 0.0;
  double ratio_min = std::numeric_limits<double>::infinity();
  double ratio_max = 0.0;
  int exponents = 0;
  double exponent_sum = 0.0;

  void Add(const Record& from, const Record& to) {
    const double ratio = Drift(to) / Drift(from);
    if (!std::isfinite(ratio)) {
      ++left_out;
      return;
    }
    ++pairs;
    log_sum += std::log(ratio);
    ratio_min = std::min(ratio_min, ratio);
    ratio_max = std::max(ratio_max, ratio);
    const double difference = to.Number("growth_exponent") - from.Number("growth_exponent");
    if (std::isfinite(difference)) {
      ++exponents;
      exponent_sum += difference;
    }
  }
};

// Change of one factor, and the factor whose settings split it into rows.
struct Change {
  std::string factor;
  std::string key;
  std::string from;
  std::string to;
  std::string split_by;
};

// Returns pairs of every formulation with every later one, then changes of the other factors.
std::vector<Change> Changes() {
  std::vector<Change> changes;
  const std::vector<std::string> formulations = FormulationNames();
  for (std::size_t i = 0; i < formulations.size(); ++i) {
    for (std::size_t j = i + 1; j < formulations.size(); ++j) {
      changes.push_back(
          {"formulation", "formulation", formulations[i], formulations[j], "geometry"});
    }
  }
  changes.push_back({"coordinates", "coordinates", "joint", "absolute", "geometry"});
  changes.push_back({"enforcement", "enforcement", "velocity", "acceleration", "geometry"});
  changes.push_back({"geometry", "geometry", "square", "general", "coordinates"});
  return changes;
}

// Returns rows of one change by setting of the splitting factor; "all" contains every pair.
std::map<std::string, Row> Compare(const Change& change, const std::vector<Run>& runs) {
  std::map<std::string, Row> rows;
  for (const Run& from : runs) {
    if (from.key.at(change.key) != change.from) continue;
    Key wanted = from.key;
    wanted[change.key] = change.to;
    const auto to = std::ranges::find(runs, wanted, &Run::key);
    if (to == runs.end()) continue;
    rows["all"].Add(from.record, to->record);
    const std::string& setting = from.key.at(change.split_by);
    if (!setting.empty()) rows[setting].Add(from.record, to->record);
  }
  return rows;
}

Record ToRecord(const Change& change, const std::string& within, const Row& row) {
  Record record;
  record.Set("factor", change.factor);
  record.Set("from", change.from);
  record.Set("to", change.to);
  record.Set("within", within);
  record.Set("pairs", std::int64_t{row.pairs});
  if (row.pairs > 0) {
    record.Set("ratio_mean", std::exp(row.log_sum / row.pairs));
    record.Set("ratio_min", row.ratio_min);
    record.Set("ratio_max", row.ratio_max);
  }
  if (row.exponents > 0) record.Set("exponent_difference", row.exponent_sum / row.exponents);
  record.Set("left_out", std::int64_t{row.left_out});
  return record;
}

}  // namespace

Table FactorialTable(std::span<const Record> records, const FactorialOptions& options) {
  Table table;
  table.title = fmt::format("Drift by factor, rtol {}, {} s", options.rtol, options.horizon);
  table.columns = {
      {"factor", "factor"},
      {"from", "from"},
      {"to", "to"},
      {"within", "within"},
      {"pairs", "pairs", Format::kInteger},
      {"ratio_mean", "drift ratio", Format::kScientific},
      {"ratio_min", "least", Format::kScientific},
      {"ratio_max", "largest", Format::kScientific},
      {"exponent_difference", "exponent diff.", Format::kExponent},
      {"left_out", "left out", Format::kInteger},
  };
  const std::vector<Run> runs = Collect(records, options);
  for (const Change& change : Changes()) {
    for (const auto& [within, row] : Compare(change, runs)) {
      table.rows.push_back(ToRecord(change, within, row));
    }
  }
  return table;
}
namespace {

// Returns the width of the scalar; any other word comes last.
std::size_t WidthOf(const Record& record) {
  const auto scalar = Parse<Scalar>(record.Text("scalar"));
  return scalar ? static_cast<std::size_t>(*scalar) : kNames<Scalar>.size();
}

}  // namespace

bool IsReferenceRung(const Record& record) { return record.Text("integrator") == "gragg"; }

std::string LadderOf(const Record& record) {
  std::string text;
  for (const char* key : kLadderKeys) text += record.Text(key) + '\n';
  for (const TableColumn& parameter : WithParameters({}, {&record, 1})) {
    text += fmt::format("{} {}\n", parameter.key, record.Text(parameter.key));
  }
  return text;
}

void SortSweepLevels(std::vector<Record>* records) {
  const auto key = [](const Record& record) {
    return std::tuple(LadderOf(record), IsReferenceRung(record), -record.Number("rtol"),
                      WidthOf(record));
  };
  std::ranges::stable_sort(*records, {}, key);
}

std::vector<std::string> PrecisionNotes() {
  return {
      "error: largest distance of a centre of mass from the reference at the end; the reference "
      "(integrator gragg) is the same for all columns: multipliers in joint coordinates without "
      "regularization, float128; its own error is the distance from another one at 10^4 times its "
      "tolerance",
      "drift: largest mismatch of the points of a constraint at accepted steps, measured in "
      "float128",
      "dominated by: round-off where the widest scalar at the same tolerance changes the number by "
      "more "
      "than a factor of two, else truncation (of the method, or by regularization); of the widest, "
      "truncation where the number is more than ten times the next narrower's scaled by the ratio "
      "of their eps"};
}
namespace {

bool HasKind(std::span<const Record> records, std::string_view kind) {
  return std::ranges::any_of(records,
                             [&](const Record& record) { return record.Text("kind") == kind; });
}

/// Returns nullptr for `factorial` and `all`.
const KindOfTable* FindKind(std::string_view name) {
  const auto kind = std::ranges::find(KindsOfTables(), name, &KindOfTable::name);
  return kind == KindsOfTables().end() ? nullptr : &*kind;
}

// Checks keys; `rows` are the rows of the table: records, or for the factorial table its own rows.
void RequireKeys(const TableView& view, std::span<const Record> rows) {
  if (!view.group.empty()) RequireKey("--group", view.group, rows);
  if (!view.sort.empty()) RequireKey("--sort", view.sort, rows);
  for (const std::string& key : view.columns) RequireKey("--columns", key, rows);
}

// Returns every record key except series; keys in all records come in the records' order.
std::vector<TableColumn> AllColumns(std::span<const Record> rows) {
  std::vector<TableColumn> columns;
  for (const std::string& key : KeysOf(rows)) {
    if (!key.starts_with("series.")) columns.push_back(ColumnOf(key, rows));
  }
  return columns;
}

std::vector<TableColumn> DefaultColumns(const std::string& kind, bool compact,
                                        std::span<const Record> rows) {
  if (kind == "all") return AllColumns(rows);
  std::vector<TableColumn> columns = WithParameters(ColumnsOfKind(kind, compact), rows);
  return compact ? TellingApart(std::move(columns), rows) : columns;
}

std::vector<TableColumn> ChosenColumns(const TableView& view, std::span<const Record> rows) {
  return Mapped<TableColumn>(view.columns,
                             [&](const std::string& key) { return ColumnOf(key, rows); });
}

bool Shows(const Table& table, const std::string& key) {
  return table.group == key || Contains(table.columns, key, &TableColumn::key);
}

// Returns a note on warnings without a column; `runs` are the sources of the table's rows.
std::optional<std::string> HiddenWarnings(const Table& table, std::span<const Record> runs) {
  const auto flagged =
      std::ranges::count_if(runs, [](const Record& run) { return IsFlagged(run, "outcome"); });
  if (flagged == 0 || Shows(table, "warnings")) return std::nullopt;
  return fmt::format("{} of {} runs finished with warnings; see column warnings", flagged,
                     runs.size());
}

// Returns notes for unreliable values if the chosen columns do not show this.
std::vector<std::string> WhatColumnsHide(const Table& table) {
  const auto shows = [&](const std::string& key) { return Shows(table, key); };
  std::vector<std::string> notes;
  const auto failed = std::ranges::count_if(table.rows, HasFailed);
  if (failed > 0 && !shows("outcome")) {
    notes.push_back(
        fmt::format("{} of {} runs did not finish; see column outcome", failed, table.rows.size()));
  }
  const bool shows_errors = std::ranges::any_of(
      table.columns, [](const TableColumn& column) { return column.key.starts_with("error_"); });
  const auto within = std::ranges::count_if(
      table.rows, [](const Record& row) { return row.Number("error_over_uncertainty") <= 1.0; });
  if (shows_errors && within > 0) {
    notes.push_back(fmt::format(
        "{} of {} runs are as near to a published series as that is accurate: it cannot "
        "distinguish them from the truth (column error_over_uncertainty, at most 1)",
        within, table.rows.size()));
  }
  const bool unresolved = std::ranges::any_of(table.columns, [&](const TableColumn& column) {
    return column.key != "outcome" &&
           !(column.key.starts_with("growth_hypothesis") ? shows("growth_hypothesis_resolved")
                                                         : shows("growth_resolved")) &&
           std::ranges::any_of(table.rows,
                               [&](const Record& row) { return IsFlagged(row, column.key); });
  });
  if (unresolved) {
    notes.push_back(
        "p is the exponent of growth; ? = not resolved (a single run, or windows disagree), as in "
        "the "
        "columns growth_resolved and growth_hypothesis_resolved");
  }
  return notes;
}

std::string TitleOf(const std::string& kind) {
  const KindOfTable* known = FindKind(kind);
  return std::string(known == nullptr ? "Records" : known->title);
}

Table Factorial(const std::vector<Record>& rows) {
  FactorialOptions options;
  if (!rows.empty()) {
    // the table has one tolerance and horizon: by default those of the first record with a
    // tolerance
    const auto first = std::ranges::find_if(
        rows, [](const Record& row) { return !std::isnan(row.Number("rtol")); });
    const Record& shown = first == rows.end() ? rows.front() : *first;
    options.rtol = shown.Number("rtol");
    options.horizon = shown.Number("horizon");
  }
  return FactorialTable(rows, options);
}

}  // namespace

std::string KindOf(const TableView& view, std::span<const Record> records) {
  if (!view.kind.empty()) return view.kind;
  const auto first = std::ranges::find_if(
      KindsOfTables(), [&](const KindOfTable& kind) { return HasKind(records, kind.records); });
  return std::string(first == KindsOfTables().end() ? "all" : first->name);
}

std::vector<Record> RowsOf(std::span<const Record> records, const TableView& view) {
  const std::string kind = KindOf(view, records);
  Selection selection = view.where;
  if (const KindOfTable* known = FindKind(kind)) {
    selection.push_back({"kind", {std::string(known->records)}});
  } else if (kind == "factorial") {
    selection.push_back({"kind", {"accuracy"}});
  }
  std::vector<Record> rows = Filter(records, selection);
  SortRows(&rows);
  if (kind == "precision") SortSweepLevels(&rows);
  return rows;
}

Table MakeTable(std::span<const Record> records, const TableView& view) {
  RequireConditions("--where", view.where, records);
  const std::string kind = KindOf(view, records);
  std::vector<Record> rows = RowsOf(records, view);
  Table table;
  if (kind == "factorial") {
    table = Factorial(rows);
    RequireKeys(view, table.rows);
    if (!view.columns.empty()) table.columns = ChosenColumns(view, table.rows);
  } else {
    RequireKeys(view, records);
    table.title = TitleOf(kind);
    table.columns =
        view.columns.empty() ? DefaultColumns(kind, view.compact, rows) : ChosenColumns(view, rows);
    table.notes = NoiseWarnings(rows);
    if (kind == "precision") table.notes = PrecisionNotes();
    table.rows = std::move(rows);
  }
  table.group = view.group;
  if (!view.sort.empty()) SortRowsBy(&table.rows, view.sort, view.descending);
  if (!view.group.empty()) SortRowsBy(&table.rows, view.group, false);
  for (std::string& note : WhatColumnsHide(table)) table.notes.push_back(std::move(note));
  if (view.compact) {
    for (std::string& note : WarningNotes(table.rows, records)) {
      table.notes.push_back(std::move(note));
    }
  } else if (const auto note = HiddenWarnings(table, kind == "factorial" ? rows : table.rows)) {
    table.notes.push_back(*note);
  }
  const auto flagged = std::ranges::count_if(
      table.rows, [](const Record& row) { return IsFlagged(row, "outcome"); });
  if (flagged > 0 && !table.title.empty()) {
    const bool shows_outcome = Shows(table, "outcome");
    const auto first = std::ranges::find_if(
        table.columns, [&](const TableColumn& column) { return column.key != table.group; });
    if (!shows_outcome && first != table.columns.end()) first->marks_warnings = true;
    table.title += fmt::format(" - {} of {} rows are flagged (marked {}, {})", flagged,
                               table.rows.size(), shows_outcome ? "? in outcome" : "*",
                               view.compact               ? "reasons below"
                               : Shows(table, "warnings") ? "reasons in column warnings"
                                                          : "column warnings has the reasons");
  }
  return table;
}

std::vector<std::string> NoiseWarnings(std::span<const Record> rows) {
  std::size_t timed = 0, noisy = 0;
  double spread = 0, load = 0;
  std::string where_spread, processors, governor;
  for (const Record& row : rows) {
    if (row.Text("kind") != "timing" && row.Text("kind") != "model") continue;
    ++timed;
    if (row.Text("noise").empty()) continue;
    ++noisy;
    for (const char* key : {"aa_spread", "aa_spread_wall"}) {
      if (!(row.Number(key) > spread)) continue;
      spread = row.Number(key);
      where_spread = row.Text("mechanism");
    }
    load = std::fmax(load, row.Number("load1"));
    processors = row.Text("processors");
    if (row.Text("governor") != "performance") governor = row.Text("governor");
  }
  if (noisy == 0) return {};
  std::string line = fmt::format(
      "warning: noisy machine in {} of {} timings (see column noise): load up to {:.1f} on {} "
      "processors",
      noisy, timed, load, processors);
  if (spread > 0) {
    line += fmt::format(", the same method timed twice differed by up to {:.1f} % ({})",
                        100 * spread, where_spread);
  }
  if (!governor.empty()) line += ", CPU governor " + governor;
  // the largest value of a quiet machine is not credible on a noisy one
  const double least = std::fmax(spread, NoiseThresholds{}.aa_spread);
  return {line,
          fmt::format("warning: differences between methods below {:.0f} % are not significant; "
                      "repeat on a quiet machine",
                      std::ceil(100 * least))};
}

}  // namespace loopbench::harness
