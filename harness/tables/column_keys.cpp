// Columns by the keys of records, whichever they are.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>
#include <utility>

#include "harness/tables/columns.h"
#include "harness/text/config_error.h"
#include "harness/text/spelling.h"

namespace loopbench::harness {
namespace {

using enum Format;

// Keys of per-loop and per-body values, which are no parameters.
bool IsFamily(const std::string& key) {
  return key.starts_with("series.") || key.starts_with("drift.loop.");
}

// Whether tables know the very key, not only the family that it belongs to. A fixed step is a key
// of those cases alone that have one, as a parameter is: no table has its column always.
bool HasColumn(const std::string& key) {
  if (key == "step") return false;
  const Measure* measure = FindMeasure(key);
  return measure != nullptr && measure->key == key && !measure->heading.words.empty();
}

// How a value without a column of its own is printed: by its type.
Format FormatOf(const std::string& key, std::span<const Record> rows) {
  for (const Record& row : rows) {
    const Value* value = row.Find(key);
    if (value == nullptr || std::holds_alternative<std::monostate>(*value)) continue;
    if (std::holds_alternative<std::int64_t>(*value)) return kInteger;
    if (std::holds_alternative<double>(*value)) return kShortest;
    return kText;
  }
  return kText;
}

bool IsShown(const std::vector<TableColumn>& columns, const std::string& key) {
  return std::ranges::find(columns, key, &TableColumn::key) != columns.end();
}

void InsertBeforeOutcome(std::vector<TableColumn>* columns, TableColumn column) {
  columns->insert(std::ranges::find(*columns, "outcome", &TableColumn::key), std::move(column));
}

}  // namespace

TableColumn ColumnOf(const std::string& key, std::span<const Record> rows) {
  if (std::optional<TableColumn> known = KnownColumn(key)) return *std::move(known);
  return {.key = key, .header = key, .format = FormatOf(key, rows), .abbreviations = {}};
}

std::string UnitOf(const TableColumn& column) {
  const std::size_t open = column.header.rfind('[');
  if (open == std::string::npos || column.header.back() != ']') return "";
  return column.header.substr(open + 1, column.header.size() - open - 2);
}

std::vector<std::string> KeysOf(std::span<const Record> rows) {
  std::vector<std::string> keys;
  for (const Record& row : rows) {
    for (const auto& [key, value] : row.items()) {
      if (std::ranges::find(keys, key) == keys.end()) keys.push_back(key);
    }
  }
  return keys;
}

std::vector<std::string> CaseKeysOf(std::span<const Record> rows) {
  std::vector<std::string> keys;
  for (const Record& row : rows) {
    for (const auto& [key, value] : row.items()) {
      if (key == "case_id" || key == "outcome") break;
      if (std::ranges::find(keys, key) == keys.end()) keys.push_back(key);
    }
  }
  return keys;
}

void RequireKey(const std::string& option, const std::string& key, std::span<const Record> rows) {
  const std::vector<std::string> keys = KeysOf(rows);
  // a column of the tables may be empty in every record
  if (std::ranges::find(keys, key) != keys.end() || HasColumn(key)) return;
  std::vector<std::string> scalars;
  std::ranges::copy_if(keys, std::back_inserter(scalars),
                       [](const std::string& known) { return !IsFamily(known); });
  const std::string nearest = NearestSpelling(key, keys);
  const std::string cure = nearest.empty() ? "" : fmt::format(" (did you mean \"{}\"?)", nearest);
  throw ConfigError(fmt::format("{}: found \"{}\", which no record has{}; expected one of {}",
                                option, key, cure, fmt::join(scalars, ", ")));
}

void RequireConditions(const std::string& option, const Selection& selection,
                       std::span<const Record> rows) {
  for (const Condition& condition : selection) {
    RequireKey(option, condition.key, rows);
    if (condition.op == Operator::kEqual || condition.op == Operator::kUnequal) {
      continue;
    }
    std::string text;  // that some record has where a number belongs
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

std::vector<TableColumn> WithParameters(std::vector<TableColumn> columns,
                                        std::span<const Record> rows) {
  for (const std::string& key : CaseKeysOf(rows)) {
    if (!HasColumn(key)) InsertBeforeOutcome(&columns, ColumnOf(key, rows));
  }
  return columns;
}

std::vector<TableColumn> TellingApart(std::vector<TableColumn> columns,
                                      std::span<const Record> rows) {
  std::vector<std::string> looks(rows.size());
  const auto show = [&](const std::string& key) {
    for (std::size_t i = 0; i < rows.size(); ++i) looks[i] += rows[i].Text(key) + '\n';
  };
  const std::vector<std::string> keys = CaseKeysOf(rows);
  for (const std::string& key : keys) {
    if (IsShown(columns, key)) show(key);
  }
  for (const std::string& key : keys) {
    if (IsShown(columns, key)) continue;
    std::map<std::string, std::string> values;  // of the first row that looks like this
    const bool tells = [&] {
      for (std::size_t i = 0; i < rows.size(); ++i) {
        const auto [first, is_new] = values.try_emplace(looks[i], rows[i].Text(key));
        if (!is_new && first->second != rows[i].Text(key)) return true;
      }
      return false;
    }();
    if (!tells) continue;
    const std::vector<TableColumn>& compact = CompactCaseColumns();
    const auto known = std::ranges::find(compact, key, &TableColumn::key);
    InsertBeforeOutcome(&columns, known != compact.end() ? *known : ColumnOf(key, rows));
    show(key);
  }
  return columns;
}

}  // namespace loopbench::harness
