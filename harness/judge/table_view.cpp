#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <limits>
#include <map>
#include <numeric>
#include <ranges>
#include <tuple>

#include "harness/base/record.h"
#include "harness/base/text.h"
#include "harness/config/experiment.h"
#include "harness/config/formulations.h"
#include "harness/judge/analysis.h"
#include "harness/judge/tables.h"

namespace loopbench::harness {
namespace {

// Identity of a run at fixed tolerance and horizon. "geometry" is "square", "general" or, for a
// problem without counterpart, empty; "family" is then the problem's own name.
using Key = std::map<std::string, std::string>;
using Runs = std::map<Key, Record>;

void SetProblem(const std::string& mechanism, Key* key) {
  (*key)["family"] = mechanism;
  (*key)["geometry"] = "";
  for (const auto& [square, general] :
       {std::pair("square-four-bar", "four-bar"), {"square-seven-bar", "general-seven-bar"}}) {
    if (mechanism != square && mechanism != general) continue;
    (*key)["family"] = fmt::format("{} | {}", square, general);
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

Runs Collect(std::span<const Record> records, double rtol, double horizon) {
  std::vector<std::string> parameters = ParametersOf(records);
  // mechanisms differ in content and are still compared
  std::erase_if(parameters,
                [](const std::string& key) { return key == "config_hash" || key == "set"; });
  Runs last;
  for (const Record& record : records) {
    if (record.Number("rtol") != rtol || record.Number("horizon") != horizon) continue;
    // timing has no drift; a run that failed before its first step has only an outcome
    if (record.Find("drift_position_max") == nullptr && !HasFailed(record)) continue;
    Key key;
    for (const char* name : {"formulation", "enforcement", "coordinates", "solver", "integrator"}) {
      key[name] = record.Text(name);
    }
    for (const std::string& name : parameters) key["parameter " + name] = record.Text(name);
    SetProblem(record.Text("mechanism"), &key);
    const auto [known, is_new] = last.try_emplace(key, record);
    if (!is_new) RequireSameCase(known->second, record);
    known->second = record;
  }
  return last;
}

double Drift(const Record& record) {
  if (HasFailed(record)) return std::numeric_limits<double>::quiet_NaN();
  return std::max(record.Number("drift_position_max"), std::numeric_limits<double>::epsilon());
}

// Change of one factor, and the factor whose settings split it into rows.
struct Change {
  std::string factor, from, to, split_by;
};

// Returns pairs of every formulation with every later one, then changes of the other factors.
std::vector<Change> Changes() {
  std::vector<Change> changes;
  const std::vector<std::string> formulations = FormulationNames();
  for (std::size_t i = 0; i < formulations.size(); ++i) {
    for (std::size_t j = i + 1; j < formulations.size(); ++j) {
      changes.push_back({"formulation", formulations[i], formulations[j], "geometry"});
    }
  }
  changes.push_back({"coordinates", "joint", "absolute", "geometry"});
  changes.push_back({"enforcement", "velocity", "acceleration", "geometry"});
  changes.push_back({"geometry", "square", "general", "coordinates"});
  return changes;
}

/// Records that differ in one factor only: from, to.
using Pairs = std::vector<std::pair<const Record*, const Record*>>;

/// Returns the pairs of one change by setting of the splitting factor; "all" contains every pair.
std::map<std::string, Pairs> PairsOf(const Change& change, const Runs& runs) {
  std::map<std::string, Pairs> pairs;
  for (const auto& [key, record] : runs) {
    if (key.at(change.factor) != change.from) continue;
    Key wanted = key;
    wanted[change.factor] = change.to;
    const auto to = runs.find(wanted);
    if (to == runs.end()) continue;
    pairs["all"].emplace_back(&record, &to->second);
    const std::string& setting = key.at(change.split_by);
    if (!setting.empty()) pairs[setting].emplace_back(&record, &to->second);
  }
  return pairs;
}

Record EffectOf(const Change& change, const std::string& within, const Pairs& pairs) {
  std::vector<double> ratios, differences;
  for (const auto& [from, to] : pairs) {
    const double ratio = Drift(*to) / Drift(*from);
    if (!std::isfinite(ratio)) continue;
    ratios.push_back(ratio);
    const double difference = to->Number("growth_exponent") - from->Number("growth_exponent");
    if (std::isfinite(difference)) differences.push_back(difference);
  }
  Record record;
  record.Set("factor", change.factor);
  record.Set("from", change.from);
  record.Set("to", change.to);
  record.Set("within", within);
  record.Set("pairs", Count(ratios.size()));
  if (!ratios.empty()) {
    double log_sum = 0.0;
    for (const double ratio : ratios) log_sum += std::log(ratio);
    record.Set("ratio_mean", std::exp(log_sum / static_cast<double>(ratios.size())));
    record.Set("ratio_min", std::ranges::min(ratios));
    record.Set("ratio_max", std::ranges::max(ratios));
  }
  if (!differences.empty()) {
    const double sum = std::accumulate(differences.begin(), differences.end(), 0.0);
    record.Set("exponent_difference", sum / static_cast<double>(differences.size()));
  }
  record.Set("left_out", Count(pairs.size() - ratios.size()));
  return record;
}

}  // namespace

Table FactorialTable(std::span<const Record> records, double rtol, double horizon) {
  Table table;
  table.title = fmt::format("Drift by factor, rtol {}, {} s", rtol, horizon);
  table.columns = Columns(
      "factor, from, to, within, pairs:integer, ratio_mean=drift ratio:scientific, "
      "ratio_min=least:scientific, ratio_max=largest:scientific, "
      "exponent_difference=exponent diff.:exponent, left_out=left out:integer");
  const Runs runs = Collect(records, rtol, horizon);
  for (const Change& change : Changes()) {
    for (const auto& [within, pairs] : PairsOf(change, runs)) {
      table.rows.push_back(EffectOf(change, within, pairs));
    }
  }
  return table;
}

bool IsReferenceRung(const Record& record) { return record.Text("integrator") == "gragg"; }

std::string LadderOf(const Record& record) {
  std::string text = ValuesOf(record, kLadderKeys);
  for (const std::string& key : ParametersOf({&record, 1})) {
    text += fmt::format("{} {}\n", key, record.Text(key));
  }
  return text;
}

void SortSweepLevels(std::vector<Record>* records) {
  const auto key = [](const Record& record) {
    const auto scalar = Parse<Scalar>(record.Text("scalar"));
    const std::size_t width =  // any other word comes last
        scalar ? static_cast<std::size_t>(*scalar) : kNames<Scalar>.size();
    return std::tuple(LadderOf(record), IsReferenceRung(record), -record.Number("rtol"), width);
  };
  std::ranges::stable_sort(*records, {}, key);
}

namespace {

const std::vector<std::string> kPrecisionNotes = {
    "error: largest distance of a centre of mass from the reference at the end; the reference "
    "(integrator gragg) is the same for all columns: multipliers in joint coordinates without "
    "regularization, float128; its own error is the distance from another one at 10^4 times its "
    "tolerance",
    "drift: largest mismatch of the points of a constraint at accepted steps, measured in float128",
    "dominated by: round-off where the widest scalar at the same tolerance changes the number by "
    "more than a factor of two, else truncation (of the method, or by regularization); of the "
    "widest, truncation where the number is more than ten times the next narrower's scaled by the "
    "ratio of their eps"};

/// Returns nullptr for `factorial` and `all`.
const KindOfTable* FindKind(std::string_view name) {
  const auto kinds = KindsOfTables();
  const auto kind = std::ranges::find(kinds, name, &KindOfTable::name);
  return kind == kinds.end() ? nullptr : &*kind;
}

// Checks keys; `rows` are the rows of the table: records, or for the factorial table its own rows.
void RequireKeys(const TableView& view, std::span<const Record> rows) {
  if (!view.group.empty()) RequireKey("--group", view.group, rows);
  if (!view.sort.empty()) RequireKey("--sort", view.sort, rows);
  for (const std::string& key : view.columns) RequireKey("--columns", key, rows);
}

// "all": every key except series; keys in all records come in the records' order.
std::vector<TableColumn> DefaultColumns(const std::string& kind, bool compact,
                                        std::span<const Record> rows) {
  if (kind == "all") {
    std::vector<std::string> keys = KeysOf(rows);
    std::erase_if(keys, [](const std::string& key) { return key.starts_with("series."); });
    return ColumnsOf(keys, rows);
  }
  std::vector<TableColumn> columns = WithParameters(ColumnsOfKind(kind, compact), rows);
  return compact ? TellingApart(std::move(columns), rows) : columns;
}

bool Shows(const Table& table, const std::string& key) {
  return table.group == key || Contains(table.columns, key, &TableColumn::key);
}

std::vector<std::string> WhatColumnsHide(const Table& table) {
  std::vector<std::string> notes;
  const std::size_t runs = table.rows.size();
  const auto failed = std::ranges::count_if(table.rows, HasFailed);
  if (failed > 0 && !Shows(table, "outcome")) {
    notes.push_back(fmt::format("{} of {} runs did not finish; see column outcome", failed, runs));
  }
  const auto has_column = [&table](const auto& is) {
    return std::ranges::any_of(table.columns, is);
  };
  const auto within = std::ranges::count_if(
      table.rows, [](const Record& row) { return row.Number("error_over_uncertainty") <= 1.0; });
  if (within > 0 &&
      has_column([](const TableColumn& column) { return column.key.starts_with("error_"); })) {
    notes.push_back(fmt::format(
        "{} of {} runs are as near to a published series as that is accurate: it cannot "
        "distinguish them from the truth (column error_over_uncertainty, at most 1)",
        within, runs));
  }
  const bool unresolved = has_column([&](const TableColumn& column) {
    const bool is_law = column.key.starts_with("growth_hypothesis");
    return column.key != "outcome" &&
           !Shows(table, is_law ? "growth_hypothesis_resolved" : "growth_resolved") &&
           std::ranges::any_of(table.rows,
                               [&](const Record& row) { return IsFlagged(row, column.key); });
  });
  if (unresolved) {
    notes.push_back(
        "p is the exponent of growth; ? = not resolved (a single run, or windows disagree), as in "
        "the columns growth_resolved and growth_hypothesis_resolved");
  }
  return notes;
}

std::size_t CountFlagged(std::span<const Record> rows) {
  return static_cast<std::size_t>(
      std::ranges::count_if(rows, [](const Record& row) { return IsFlagged(row, "outcome"); }));
}

/// Marks flagged rows in the title, and in the first column if the outcome is hidden.
void MarkFlagged(bool has_reasons_below, Table* table) {
  const std::size_t flagged = CountFlagged(table->rows);
  if (flagged == 0 || table->title.empty()) return;
  const bool shows_outcome = Shows(*table, "outcome");
  const auto first = std::ranges::find_if(
      table->columns, [&](const TableColumn& column) { return column.key != table->group; });
  if (!shows_outcome && first != table->columns.end()) first->marks_warnings = true;
  table->title += fmt::format(" - {} of {} rows are flagged (marked {}, {})", flagged,
                              table->rows.size(), shows_outcome ? "? in outcome" : "*",
                              has_reasons_below           ? "reasons below"
                              : Shows(*table, "warnings") ? "reasons in column warnings"
                                                          : "column warnings has the reasons");
}

/// Returns the table at the tolerance and horizon of the first record with a tolerance.
Table Factorial(const std::vector<Record>& rows) {
  if (rows.empty()) return FactorialTable(rows);
  const auto first =
      std::ranges::find_if(rows, [](const Record& row) { return !std::isnan(row.Number("rtol")); });
  const Record& shown = first == rows.end() ? rows.front() : *first;
  return FactorialTable(rows, shown.Number("rtol"), shown.Number("horizon"));
}

}  // namespace

std::string KindOf(const TableView& view, std::span<const Record> records) {
  if (!view.kind.empty()) return view.kind;
  for (const KindOfTable& kind : KindsOfTables()) {
    const auto is_of_kind = [&](const Record& record) {
      return record.Text("kind") == kind.records;
    };
    if (std::ranges::any_of(records, is_of_kind)) return std::string(kind.name);
  }
  return "all";
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
  const std::size_t runs = rows.size(), flagged = CountFlagged(rows);
  Table table;
  if (kind == "factorial") {
    table = Factorial(rows);
    RequireKeys(view, table.rows);
    if (!view.columns.empty()) table.columns = ColumnsOf(view.columns, table.rows);
  } else {
    RequireKeys(view, records);
    const KindOfTable* known = FindKind(kind);
    table.title = known == nullptr ? "Records" : known->title;
    table.columns = view.columns.empty() ? DefaultColumns(kind, view.compact, rows)
                                         : ColumnsOf(view.columns, rows);
    table.notes = kind == "precision" ? kPrecisionNotes : NoiseWarnings(rows);
    table.rows = std::move(rows);
  }
  table.group = view.group;
  if (!view.sort.empty()) SortRowsBy(&table.rows, view.sort, view.descending);
  if (!view.group.empty()) SortRowsBy(&table.rows, view.group, false);
  table.AddNotes(WhatColumnsHide(table));
  if (view.compact) {
    table.AddNotes(WarningNotes(table.rows, records));
  } else if (flagged > 0 && !Shows(table, "warnings")) {
    table.notes.push_back(
        fmt::format("{} of {} runs finished with warnings; see column warnings", flagged, runs));
  }
  MarkFlagged(view.compact, &table);
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

namespace {

constexpr std::size_t kRowsNamed = 3, kProblemsNamed = 6;

std::string NoteOf(const WarningRow& warning, std::span<const Record> rows,
                   const std::vector<std::string>& keys) {
  std::vector<std::string> names;
  for (const Record& row : rows) {
    if (!HasWarning(row, warning.code)) continue;
    names.push_back(fmt::format("{} ({})", NameOfRow(row, keys), warning.number(row)));
  }
  if (names.empty()) return "";
  return fmt::format("{}: {}: {}", warning.code, warning.sentence,
                     FirstOf(names, kRowsNamed, "; ", "; and {} more"));
}

// Runs of one problem, horizon and tolerance.
using ProblemKey = std::tuple<std::string, double, double>;

ProblemKey ProblemOf(const Record& record) {
  return {record.Text("problem_id"), record.Number("horizon"), record.Number("rtol")};
}

/// Returns a name with the parameters in which the store's `records` differ.
std::string NameOfProblem(const Record& record, std::span<const Record> records) {
  std::vector<std::string> keys = {"rtol", "horizon"};
  const std::vector<std::string> telling = DistinguishingKeys(records);
  for (const std::string& key : ParametersOf(records)) {
    if (Contains(telling, key)) keys.push_back(key);
  }
  return fmt::format("{}: {} {}", kDisagreementWarning, record.Text("mechanism"),
                     NameOfRow(record, keys));
}

/// Names the runs that agree with each other; each of `runs` has a cluster.
std::string NoteOfProblem(const std::vector<Record>& runs, std::span<const Record> records) {
  // the runs that decide if runs end differently (harness/judge/analysis.h)
  const std::string deciding = IsAlike(runs, "integrator")
                                   ? "finer tolerances"
                                   : "finer tolerances or an integrator all of whose runs agree";
  const std::vector<std::string> keys = DistinguishingKeys(runs);
  auto clusters = GroupBy(
      runs, [](const Record& run) { return static_cast<std::int64_t>(run.Number("agreement")); });
  std::ranges::sort(clusters, {}, [](const auto& cluster) { return cluster.first; });
  std::string text, alone;
  for (const auto& [number, members] : clusters) {
    const std::string names =
        Joined(members, ", ", [&](const Record& run) { return NameOfRow(run, keys); });
    const bool cleared = !HasWarning(members.front(), kDisagreementWarning);
    if (members.size() > 1) {
      text += fmt::format("; {} agree{}", names, cleared ? ", also with " + deciding : "");
    } else {
      alone += (alone.empty() ? "; no agreement: " : ", ") + names +
               (cleared ? " (agrees with " + deciding + ")" : "");
    }
  }
  text += alone;
  const std::string problem = NameOfProblem(runs.front(), records);
  if (clusters.size() == 1) return problem + ": another final state than with " + deciding + text;
  const PoseDifference worst = LargestDifference(runs);
  return fmt::format(
      "{}: final states differ by {:.2g} links or rad ({}), more than {:.0f} tolerances{}", problem,
      worst.largest, worst.body, kMaxTolerances, text);
}

}  // namespace

std::string NameOfRow(const Record& row, const std::vector<std::string>& keys) {
  std::string words, numbers;
  for (const std::string& key : keys) {
    const std::string text = Cell(row, {.key = key, .header = "", .format = Format::kShortest});
    if (text.empty()) continue;
    if (std::holds_alternative<std::string>(*row.Find(key))) {
      words += (words.empty() ? "" : "/") + text;
    } else {
      numbers += fmt::format("{}{} {}", numbers.empty() ? "" : " ", key, text);
    }
  }
  const std::string name = words + (words.empty() || numbers.empty() ? "" : " ") + numbers;
  return name.empty() ? row.Text("mechanism") : name;
}

std::vector<std::pair<std::string, std::string>> MeaningsOfWarnings() {
  std::vector<std::pair<std::string, std::string>> meanings;
  for (const WarningRow& row : WarningRows()) meanings.emplace_back(row.code, row.sentence);
  meanings.emplace_back(kDisagreementWarning, "other runs of the problem have other final states");
  return meanings;
}

std::vector<std::string> WarningNotes(std::span<const Record> rows,
                                      std::span<const Record> records) {
  if (std::ranges::none_of(rows, [](const Record& row) { return HasWarning(row); })) return {};
  std::vector<std::string> notes = {
      "warnings of flagged runs (docs/reference/outcomes-and-warnings.md):"};
  const std::vector<std::string> keys = DistinguishingKeys(rows);
  for (const WarningRow& row : WarningRows()) {
    if (const std::string note = NoteOf(row, rows, keys); !note.empty()) notes.push_back(note);
  }
  std::vector<Record> disagreeing;
  std::ranges::copy_if(rows, std::back_inserter(disagreeing),
                       [](const Record& row) { return HasWarning(row, kDisagreementWarning); });
  const auto problems = GroupBy(disagreeing, ProblemOf);
  for (const auto& [problem, flagged] : problems | std::views::take(kProblemsNamed)) {
    std::vector<Record> runs;
    std::ranges::copy_if(records, std::back_inserter(runs), [&](const Record& record) {
      return record.Find("agreement") != nullptr && ProblemOf(record) == problem;
    });
    // no other run at this tolerance: no cluster
    notes.push_back(runs.empty() ? NameOfProblem(flagged.front(), records) +
                                       ": another final state than with finer tolerances"
                                 : NoteOfProblem(runs, records));
  }
  if (problems.size() > kProblemsNamed) {
    notes.push_back(fmt::format("{}: {} problems more; column agreement numbers the agreeing sets",
                                kDisagreementWarning, problems.size() - kProblemsNamed));
  }
  return notes;
}

}  // namespace loopbench::harness
