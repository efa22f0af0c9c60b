#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <limits>
#include <map>
#include <numeric>
#include <optional>
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

using Run = std::pair<const Key, Record>;

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

std::vector<Run> Collect(std::span<const Record> records, double rtol, double horizon) {
  const std::vector<TableColumn> parameters = WithParameters({}, records);
  std::map<Key, Record> last;
  for (const Record& record : records) {
    if (record.Number("rtol") != rtol || record.Number("horizon") != horizon) continue;
    // timing has no drift; a run that failed before its first step has only an outcome
    if (record.Find("drift_position_max") == nullptr && !HasFailed(record)) continue;
    Key key;
    for (const char* name : {"formulation", "enforcement", "coordinates", "solver", "integrator"}) {
      key[name] = record.Text(name);
    }
    for (const TableColumn& parameter : parameters) {
      // mechanisms differ in content and are still compared
      if (parameter.key == "config_hash" || parameter.key == "set") continue;
      key["parameter " + parameter.key] = record.Text(parameter.key);
    }
    SetProblem(record.Text("mechanism"), &key);
    const auto [known, is_new] = last.try_emplace(key, record);
    if (!is_new) RequireSameCase(known->second, record);
    known->second = record;
  }
  return {last.begin(), last.end()};
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
std::map<std::string, Pairs> PairsOf(const Change& change, const std::vector<Run>& runs) {
  std::map<std::string, Pairs> pairs;
  for (const auto& [key, record] : runs) {
    if (key.at(change.factor) != change.from) continue;
    Key wanted = key;
    wanted[change.factor] = change.to;
    const auto to = std::ranges::find(runs, wanted, &Run::first);
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
  const std::vector<Run> runs = Collect(records, rtol, horizon);
  for (const Change& change : Changes()) {
    for (const auto& [within, pairs] : PairsOf(change, runs)) {
      table.rows.push_back(EffectOf(change, within, pairs));
    }
  }
  return table;
}

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
    const auto scalar = Parse<Scalar>(record.Text("scalar"));
    const std::size_t width =  // any other word comes last
        scalar ? static_cast<std::size_t>(*scalar) : kNames<Scalar>.size();
    return std::tuple(LadderOf(record), IsReferenceRung(record), -record.Number("rtol"), width);
  };
  std::ranges::stable_sort(*records, {}, key);
}

namespace {

/// Meaning of error, drift and dominant error.
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

bool HasKind(std::span<const Record> records, std::string_view kind) {
  return std::ranges::any_of(records,
                             [&](const Record& record) { return record.Text("kind") == kind; });
}

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
  std::vector<std::string> notes;
  const auto failed = std::ranges::count_if(table.rows, HasFailed);
  if (failed > 0 && !Shows(table, "outcome")) {
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
    const bool is_law = column.key.starts_with("growth_hypothesis");
    return column.key != "outcome" &&
           !Shows(table, is_law ? "growth_hypothesis_resolved" : "growth_resolved") &&
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
    if (HasKind(records, kind.records)) return std::string(kind.name);
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
  Table table;
  if (kind == "factorial") {
    table = Factorial(rows);
    RequireKeys(view, table.rows);
    if (!view.columns.empty()) table.columns = ChosenColumns(view, table.rows);
  } else {
    RequireKeys(view, records);
    const KindOfTable* known = FindKind(kind);
    table.title = known == nullptr ? "Records" : known->title;
    table.columns =
        view.columns.empty() ? DefaultColumns(kind, view.compact, rows) : ChosenColumns(view, rows);
    table.notes = NoiseWarnings(rows);
    if (kind == "precision") table.notes = kPrecisionNotes;
    table.rows = std::move(rows);
  }
  table.group = view.group;
  if (!view.sort.empty()) SortRowsBy(&table.rows, view.sort, view.descending);
  if (!view.group.empty()) SortRowsBy(&table.rows, view.group, false);
  const auto add_notes = [&table](std::vector<std::string> notes) {
    std::ranges::move(notes, std::back_inserter(table.notes));
  };
  add_notes(WhatColumnsHide(table));
  if (view.compact) {
    add_notes(WarningNotes(table.rows, records));
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

// Notes on warnings.

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
  const std::size_t more = names.size() - std::min(names.size(), kRowsNamed);
  return fmt::format("{}: {}: {}{}", warning.code, warning.sentence,
                     Joined(names | std::views::take(kRowsNamed), "; "),
                     more > 0 ? fmt::format("; and {} more", more) : "");
}

// Runs of one problem, horizon and tolerance.
using ProblemKey = std::pair<std::string, std::pair<double, double>>;

ProblemKey ProblemOf(const Record& record) {
  return {record.Text("problem_id"), {record.Number("horizon"), record.Number("rtol")}};
}

/// Returns a name with the parameters in which the store's `records` differ.
std::string NameOfProblem(const Record& record, std::span<const Record> records) {
  std::vector<std::string> keys = {"rtol", "horizon"};
  const std::vector<std::string> telling = DistinguishingKeys(records);
  for (const TableColumn& parameter : WithParameters({}, records)) {
    if (Contains(telling, parameter.key)) keys.push_back(parameter.key);
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
  std::map<std::int64_t, std::vector<Record>> clusters;
  for (const Record& run : runs) {
    clusters[static_cast<std::int64_t>(run.Number("agreement"))].push_back(run);
  }
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

std::vector<std::string> DistinguishingKeys(std::span<const Record> rows) {
  std::vector<std::string> keys;
  for (const std::string& key : CaseKeysOf(rows)) {
    if (key == "atol" && AtolFollowsRtol(rows)) continue;
    if (!IsAlike(rows, key)) keys.push_back(key);
  }
  return keys;
}

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
  std::vector<ProblemKey> problems;
  for (const Record& row : rows) {
    if (HasWarning(row, kDisagreementWarning)) AddOnce(problems, ProblemOf(row));
  }
  for (const ProblemKey& problem : problems | std::views::take(kProblemsNamed)) {
    std::vector<Record> runs;
    std::ranges::copy_if(records, std::back_inserter(runs), [&](const Record& record) {
      return record.Find("agreement") != nullptr && ProblemOf(record) == problem;
    });
    // no other run at this tolerance: no cluster
    notes.push_back(runs.empty()
                        ? NameOfProblem(*std::ranges::find(rows, problem, ProblemOf), records) +
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
