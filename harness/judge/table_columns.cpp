#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>
#include <ranges>
#include <stdexcept>
#include <utility>

#include "harness/base/text.h"
#include "harness/judge/tables.h"
#include "mechanism/formulation/options.h"

namespace loopbench::harness {
namespace {

using std::string_view;
using enum Format;

std::string InUnit(const std::string& words, string_view unit) {
  return unit.empty() ? words : fmt::format("{} [{}]", words, unit);
}

TableColumn Of(const Measure& measure, string_view key) {
  const auto& [words, unit, format] = measure.heading;
  const string_view shown = words == "*" ? key.substr(measure.key.size() - 1) : words;
  return {std::string(key), InUnit(std::string(shown), unit), format};
}

/// Columns of narrow tables with another heading, and shorter words for values. Others have their
/// key as heading.
const std::vector<TableColumn>& ShortColumns() {
  static const std::vector<TableColumn> kColumns = [] {
    std::vector<TableColumn> columns = Columns(
        "formulation=form., enforcement=enf., coordinates=coord, solver=fact., horizon=T/s, "
        "outcome, drift_position_max=drift [m], energy_error_max=dE [J], growth_exponent=t^p, "
        "rhs_ns_median=rhs [ns], wall_s_median=wall [s], error_final=error [m], "
        "error_dominated_by=by, drift_dominated_by=by, model_error=model error [m], "
        "rhs_evaluations=rhs, model_rhs_ratio=of full, wall_s=wall [s], model_wall_ratio=of full, "
        "model_verdict=verdict, reference_valid_until=valid until [s], reference_error=to [m], "
        "cpu_s=CPU [s], message=why no further");
    const auto abbreviate = [&columns](string_view key, auto pairs) {
      std::ranges::find(columns, key, &TableColumn::key)->abbreviations = std::move(pairs);
    };
    using Abbreviations = decltype(TableColumn::abbreviations);
    Abbreviations levels;
    for (const LevelTraits& level : Levels()) levels.emplace_back(level.name, level.abbreviation);
    const Abbreviations parts = {{"truncation", "trunc"}, {"round-off", "round"}};
    abbreviate("enforcement", levels);
    abbreviate("coordinates", Abbreviations{{"absolute", "abs"}});
    abbreviate("solver", Abbreviations{{"rank-revealing", "r-rev"}});
    abbreviate("error_dominated_by", parts);
    abbreviate("drift_dominated_by", parts);
    abbreviate("outcome", Abbreviations{{"finished", "ok"},
                                        {"step-too-small", "small step"},
                                        {"inconsistent-start", "bad start"},
                                        {"inconsistent-motion", "bad motion"},
                                        {"newton-failure", "newton"},
                                        {"integrator-error", "integrator"}});
    return columns;
  }();
  return kColumns;
}

/// Returns the column of a narrow table. "key+" is dropped later than columns that identify rows,
/// "key-" earlier than others.
TableColumn CompactColumn(string_view word) {
  constexpr int kAnswer = 2;
  const int importance = word.ends_with('+') ? kAnswer : word.ends_with('-') ? -1 : 0;
  if (importance != 0) word.remove_suffix(1);
  const auto known = std::ranges::find(ShortColumns(), word, &TableColumn::key);
  TableColumn column = known != ShortColumns().end()
                           ? *known
                           : TableColumn{.key = std::string(word), .header = std::string(word)};
  column.format = FindMeasure(word)->heading.format;
  column.importance = importance;
  return column;
}

constexpr string_view kCase =
    "experiment mechanism formulation enforcement coordinates solver integrator rtol atol horizon "
    "outcome t_reached";
constexpr string_view kCompactCase =
    "mechanism formulation enforcement coordinates solver rtol horizon outcome";

// Returns true if tables contain this exact key, not only its family. A fixed step is a key only of
// cases that have one, like a parameter: no table always has its column.
bool HasColumn(const std::string& key) {
  if (key == "step") return false;
  const Measure* measure = FindMeasure(key);
  return measure != nullptr && measure->key == key && !measure->heading.words.empty();
}

Format FormatOf(const std::string& key, std::span<const Record> rows) {
  for (const Record& row : rows) {
    const Value* value = row.Find(key);
    if (value == nullptr || std::holds_alternative<std::monostate>(*value)) continue;
    return std::holds_alternative<std::int64_t>(*value) ? kInteger
           : std::holds_alternative<double>(*value)     ? kShortest
                                                        : kText;
  }
  return kText;
}

void InsertBeforeOutcome(std::vector<TableColumn>* columns, TableColumn column) {
  columns->insert(std::ranges::find(*columns, "outcome", &TableColumn::key), std::move(column));
}

}  // namespace

std::vector<TableColumn> Columns(std::string_view rows) {
  constexpr std::string_view kFormats[] = {"",         "integer", "shortest", "scientific",
                                           "exponent", "fixed",   "seconds"};
  std::vector<TableColumn> columns;
  while (!rows.empty()) {
    std::string_view row = rows.substr(0, rows.find(", "));
    rows.remove_prefix(std::min(row.size() + 2, rows.size()));
    const auto next = [&row](char end) {
      const std::string part(row.substr(0, row.find(end)));
      row.remove_prefix(std::min(part.size() + 1, row.size()));
      return part;
    };
    const std::string heading = next(':'), format = next(':');
    const std::size_t equals = heading.find('=');
    TableColumn& column = columns.emplace_back();
    column.key = heading.substr(0, equals);
    column.header = heading.substr(equals == heading.npos ? 0 : equals + 1);
    const auto* known = std::ranges::find(kFormats, format);
    if (known == std::end(kFormats)) throw std::logic_error("no format of columns: " + format);
    column.format = static_cast<Format>(known - kFormats);
    if (!row.empty()) column.importance = std::stoi(std::string(row));
  }
  return columns;
}

bool IsFlagged(const Record& row, const std::string& key) {
  const Value* value = row.Find(key);
  if (value == nullptr || std::holds_alternative<std::monostate>(*value)) return false;
  if (key == "outcome") return !HasFailed(row) && !row.Text("warnings").empty();
  if (key == "growth_hypothesis") return row.Text("growth_hypothesis_resolved") != "true";
  if (std::isnan(row.Number(key))) return false;
  if (key == "energy_growth_exponent" || key == "correction_growth_exponent") return true;
  return (key == "growth_exponent" || key == "growth_exponent_late") &&
         row.Text("growth_resolved") != "true";
}

bool HasFailed(const Record& row) {
  const std::string outcome = row.Text("outcome");
  return !outcome.empty() && outcome != "finished";
}

std::string OutcomeColour(const Record& row, const TableColumn& column) {
  if (column.key != "outcome") return "";
  if (HasFailed(row)) return "31";
  return IsFlagged(row, column.key) ? "33" : "";
}

std::span<const KindOfTable> KindsOfTables() {
  static constexpr KindOfTable kKinds[] = {
      {"drift", "accuracy", "Drift",
       "CASE warnings agreement drift_position_max drift_rotation_max drift_velocity_max "
       "drift_acceleration_max loop_closure_max correction_max worst_loop energy_error_max "
       "growth_exponent growth_spread growth_regime growth_resolved growth_hypothesis "
       "growth_hypothesis_resolved ensemble steps rejected rhs_evaluations rank_min rcond_min "
       "state_hash restarts branch_error_max closed_form_error_max message ADDED",
       "CASE drift_position_max+ energy_error_max growth_exponent"},
      {"precision", "precision", "Precision",
       "experiment mechanism formulation enforcement coordinates solver integrator scalar rtol "
       "atol horizon outcome t_reached error_final error_dominated_by drift_position_max "
       "drift_dominated_by steps rejected restarts rhs_evaluations",
       "mechanism formulation enforcement coordinates scalar rtol outcome error_final+ "
       "error_dominated_by drift_position_max drift_dominated_by steps"},
      {"models", "model", "Models",
       "mechanism model formulation enforcement coordinates integrator rtol horizon outcome "
       "model_motion bodies joints model_error model_error_at reference_error "
       "reference_valid_until model_accepts model_verdict error_position_max rhs_evaluations "
       "model_rhs_ratio wall_s model_wall_ratio noise",
       "mechanism model bodies model_error rhs_evaluations model_rhs_ratio wall_s "
       "model_wall_ratio model_verdict"},
      {"timing", "timing", "Timing",
       "CASE bodies joints loops dof rhs_ns_median rhs_ns_p10 rhs_ns_p90 ns_per_body "
       "step_us_median wall_s_median realtime_factor repeats rhs_ns_min wall_s_min wall_s_p10 "
       "wall_s_p90 aa_spread aa_spread_wall calibration_ns calibration_wall_ns "
       "discarded_repetitions load1 processors governor noise",
       "CASE bodies- rhs_ns_median+ wall_s_median"},
      {"references", "reference", "References",
       "experiment mechanism horizon outcome reference reference_valid_until reference_error "
       "reference_runs cpu_s rhs_evaluations message",
       "mechanism horizon outcome reference reference_valid_until+ reference_error+ cpu_s "
       "message"}};
  return kKinds;
}

std::vector<TableColumn> ColumnsOfKind(string_view name, bool compact) {
  const auto kinds = KindsOfTables();
  const auto known = std::ranges::find(kinds, name, &KindOfTable::name);
  const KindOfTable& kind = known == kinds.end() ? kinds.front() : *known;
  std::string words(compact ? kind.compact : kind.columns);
  if (words.starts_with("CASE")) words.replace(0, 4, compact ? kCompactCase : kCase);
  std::vector<TableColumn> columns;
  for (const auto part : std::views::split(words, ' ')) {
    const string_view word(part.begin(), part.end());
    if (word != "ADDED") {
      columns.push_back(compact ? CompactColumn(word) : Of(*FindMeasure(word), word));
      continue;
    }
    for (const Measure* measure : AddedMeasures()) {
      const bool single = measure->type != ValueType::kNumbers && !measure->key.ends_with('*');
      if (single && !measure->heading.words.empty()) columns.push_back(Of(*measure, measure->key));
    }
  }
  return columns;
}

std::optional<TableColumn> KnownColumn(string_view key) {
  const Measure* measure = FindMeasure(key);
  if (measure == nullptr || measure->heading.words.empty()) return std::nullopt;
  return Of(*measure, key);
}

std::optional<TableColumn> CompactCaseColumn(string_view key) {
  for (const auto part : std::views::split(kCompactCase, ' ')) {
    if (string_view(part.begin(), part.end()) == key) return CompactColumn(key);
  }
  return std::nullopt;
}

TableColumn ColumnOf(const std::string& key, std::span<const Record> rows) {
  return KnownColumn(key).value_or(TableColumn{key, key, FormatOf(key, rows)});
}

std::vector<TableColumn> ColumnsOf(const std::vector<std::string>& keys,
                                   std::span<const Record> rows) {
  return Mapped<TableColumn>(keys, [&](const std::string& key) { return ColumnOf(key, rows); });
}

std::string UnitOf(const TableColumn& column) {
  const std::size_t open = column.header.rfind('[');
  if (open == std::string::npos || column.header.back() != ']') return "";
  return column.header.substr(open + 1, column.header.size() - open - 2);
}

std::string WithUnit(const std::string& words, const std::string& key) {
  return InUnit(words, UnitOf(ColumnOf(key, {})));
}

std::string NameBy(const Record& record, const std::vector<std::string>& keys,
                   string_view separator) {
  return Joined(keys, separator, [&](const std::string& key) {
    const Value* value = record.Find(key);
    const bool is_text = value != nullptr && std::holds_alternative<std::string>(*value);
    return (is_text ? "" : key + " ") + record.Text(key);
  });
}

std::string FirstOf(std::span<const std::string> texts, std::size_t most, string_view separator,
                    string_view more) {
  const std::string text = Joined(texts | std::views::take(most), separator);
  if (texts.size() <= most) return text;
  return text + fmt::format(fmt::runtime(more), texts.size() - most);
}

std::vector<std::string> KeysOf(std::span<const Record> rows) {
  std::vector<std::string> keys;
  for (const Record& row : rows) {
    for (const auto& [key, value] : row.items()) AddOnce(keys, key);
  }
  return keys;
}

std::vector<std::string> CaseKeysOf(std::span<const Record> rows) {
  std::vector<std::string> keys;
  for (const Record& row : rows) {
    for (const auto& [key, value] : row.items()) {
      if (key == "case_id" || key == "outcome") break;
      AddOnce(keys, key);
    }
  }
  return keys;
}

bool IsAlike(std::span<const Record> rows, const std::string& key) {
  return std::ranges::all_of(
      rows, [&](const Record& row) { return row.Text(key) == rows.front().Text(key); });
}

std::vector<std::string> DistinguishingKeys(std::span<const Record> rows) {
  std::vector<std::string> keys = CaseKeysOf(rows);
  std::erase_if(keys, [&](const std::string& key) {
    return (key == "atol" && AtolFollowsRtol(rows)) || IsAlike(rows, key);
  });
  return keys;
}

bool AtolFollowsRtol(std::span<const Record> rows) {
  return std::ranges::all_of(
      rows, [](const Record& row) { return row.Text("atol") == row.Text("rtol"); });
}

void RequireKey(const std::string& option, const std::string& key, std::span<const Record> rows) {
  const std::vector<std::string> keys = KeysOf(rows);
  // a column of the tables may be empty in every record
  if (Contains(keys, key) || HasColumn(key)) return;
  const std::string nearest = NearestSpelling(key, keys);
  const std::string cure = nearest.empty() ? "" : fmt::format(" (did you mean \"{}\"?)", nearest);
  std::vector<std::string> scalars = keys;  // without values of each loop and body
  std::erase_if(scalars, [](const std::string& one) {
    return one.starts_with("series.") || one.starts_with("drift.loop.");
  });
  throw ConfigError(fmt::format("{}: found \"{}\", which no record has{}; expected one of {}",
                                option, key, cure, fmt::join(scalars, ", ")));
}

void RequireConditions(const std::string& option, const Selection& selection,
                       std::span<const Record> rows) {
  for (const Condition& condition : selection) {
    RequireKey(option, condition.key, rows);
    if (condition.op == Operator::kEqual || condition.op == Operator::kUnequal) continue;
    std::string text;  // text of a record instead of a number
    const bool has_number = std::ranges::any_of(rows, [&](const Record& row) {
      if (text.empty()) text = row.Text(condition.key);
      return !std::isnan(row.Number(condition.key));
    });
    if (has_number || text.empty()) continue;
    throw ConfigError(
        fmt::format("{} {}: found \"{}\" in records, expected a key of numbers behind "
                    "which {} may stand",
                    option, ToText({condition}), text, ToString(condition.op)));
  }
}

std::vector<std::string> ParametersOf(std::span<const Record> rows) {
  std::vector<std::string> keys = CaseKeysOf(rows);
  std::erase_if(keys, HasColumn);
  return keys;
}

std::vector<TableColumn> WithParameters(std::vector<TableColumn> columns,
                                        std::span<const Record> rows) {
  for (TableColumn& column : ColumnsOf(ParametersOf(rows), rows)) {
    InsertBeforeOutcome(&columns, std::move(column));
  }
  return columns;
}

std::vector<TableColumn> TellingApart(std::vector<TableColumn> columns,
                                      std::span<const Record> rows) {
  std::vector<std::string> looks(rows.size()), hidden;
  const auto show = [&](const std::string& key) {
    for (std::size_t i = 0; i < rows.size(); ++i) looks[i] += rows[i].Text(key) + '\n';
  };
  for (const std::string& key : CaseKeysOf(rows)) {
    if (Contains(columns, key, &TableColumn::key)) {
      show(key);
    } else {
      hidden.push_back(key);
    }
  }
  for (const std::string& key : hidden) {
    std::map<std::string, std::string> values;  // of the first row with this appearance
    bool tells = false;
    for (std::size_t i = 0; i < rows.size() && !tells; ++i) {
      const std::string value = rows[i].Text(key);
      tells = values.try_emplace(looks[i], value).first->second != value;
    }
    if (!tells) continue;
    InsertBeforeOutcome(&columns, CompactCaseColumn(key).value_or(ColumnOf(key, rows)));
    show(key);
  }
  return columns;
}

}  // namespace loopbench::harness
