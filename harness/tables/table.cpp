#include "harness/tables/table.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <string_view>

#include "harness/text/escape.h"

namespace loopbench::harness {
namespace {

std::string FormatNumber(double number, Format format) {
  if (std::isnan(number)) return "";
  switch (format) {
    case Format::kInteger:
      return fmt::format("{:.0f}", number);
    case Format::kScientific:
      return fmt::format("{:.2e}", number);
    case Format::kExponent:
      return fmt::format("{:.2f}", number);
    case Format::kFixed:
      return fmt::format("{:.1f}", number);
    case Format::kSeconds:
      return fmt::format("{:.4g}", number);
    case Format::kText:
    case Format::kShortest:
      break;
  }
  return NumberCell(number);
}

// Every digit, for CSV: absent and NaN values are empty as in the other writers.
std::string FullPrecision(const Record& row, const std::string& key) {
  const Value* value = row.Find(key);
  if (value == nullptr) return "";
  if (const auto* series = std::get_if<std::vector<double>>(value)) {
    std::string joined;
    for (const double number : *series) {
      joined += fmt::format("{}{}", joined.empty() ? "" : ";", number);
    }
    return joined;
  }
  if (const auto* number = std::get_if<double>(value); number != nullptr && std::isnan(*number)) {
    return "";
  }
  return row.Text(key);
}

}  // namespace

std::string NumberCell(double number) {
  // a number with more digits than people write is a computed one
  const std::string text = fmt::format("{}", number);
  const std::size_t first = std::min(text.find_first_not_of("-0."), text.size());
  constexpr int kWritten = 6, kLeast = 4;
  const auto digits = std::count_if(
      text.begin() + static_cast<std::ptrdiff_t>(first),
      text.begin() + static_cast<std::ptrdiff_t>(std::min(text.find('e'), text.size())),
      [](char c) { return c != '.'; });
  if (digits <= kWritten) return text;
  const double size = std::abs(number);
  const int before_point = size < 1e15 && size >= 1.0 ? static_cast<int>(std::log10(size)) + 1 : 0;
  return fmt::format("{:.{}g}", number, std::max(kLeast, before_point));
}

bool IsDoubtful(const Record& row, const std::string& key) {
  const Value* value = row.Find(key);
  if (value == nullptr || std::holds_alternative<std::monostate>(*value)) return false;
  if (key == "outcome") return !HasFailed(row) && !row.Text("doubts").empty();
  if (key == "growth_hypothesis") return row.Text("growth_hypothesis_resolved") != "true";
  if (std::isnan(row.Number(key))) return false;
  if (key == "energy_growth_exponent" || key == "correction_growth_exponent") return true;
  return (key == "growth_exponent" || key == "growth_exponent_late") &&
         row.Text("growth_resolved") != "true";
}

std::string Cell(const Record& row, const TableColumn& column) {
  const Value* value = row.Find(column.key);
  std::string mark = value != nullptr && IsDoubtful(row, column.key) ? "?" : "";
  if (column.marks_doubts && IsDoubtful(row, "outcome")) mark += '*';
  if (value == nullptr) return mark;
  if (const auto* number = std::get_if<double>(value)) {
    return FormatNumber(*number, column.format) + mark;
  }
  if (std::holds_alternative<std::vector<double>>(*value)) return FullPrecision(row, column.key);
  const std::string text = row.Text(column.key);
  const auto it =
      std::ranges::find(column.abbreviations, text, &std::pair<std::string, std::string>::first);
  return (it == column.abbreviations.end() ? text : it->second) + mark;
}

std::vector<RowGroup> Groups(const Table& table) {
  if (table.group.empty()) return {{"", table.rows}};
  const TableColumn column{table.group, table.group, Format::kShortest, {}};
  std::vector<RowGroup> groups;
  for (const Record& row : table.rows) {
    const std::string cell = Cell(row, column);
    const std::string heading = fmt::format("{} = {}", table.group, cell.empty() ? "(none)" : cell);
    auto it = std::ranges::find(groups, heading, &RowGroup::heading);
    if (it == groups.end()) it = groups.insert(it, {heading, {}});
    it->rows.push_back(row);
  }
  return groups;
}

void AddRow(const std::vector<Value>& values, Table* table) {
  Record& row = table->rows.emplace_back();
  for (std::size_t i = 0; i < values.size(); ++i) row.Set(table->columns.at(i).key, values[i]);
}

bool HasFailed(const Record& row) {
  const std::string outcome = row.Text("outcome");
  return !outcome.empty() && outcome != "finished";
}

std::string OutcomeColour(const Record& row, const TableColumn& column) {
  if (column.key != "outcome") return "";
  if (HasFailed(row)) return "31";
  return IsDoubtful(row, column.key) ? "33" : "";
}

std::vector<TableColumn> ColumnsUnderHeading(const Table& table) {
  std::vector<TableColumn> columns = table.columns;
  std::erase_if(columns, [&](const TableColumn& column) { return column.key == table.group; });
  return columns;
}

std::string ToCsv(const Table& table) {
  std::string out;
  for (std::size_t c = 0; c < table.columns.size(); ++c) {
    out += (c == 0 ? "" : ",") + EscapeCsv(table.columns[c].key);
  }
  out += '\n';
  for (const Record& row : table.rows) {
    for (std::size_t c = 0; c < table.columns.size(); ++c) {
      const std::string& key = table.columns[c].key;
      const Value* value = row.Find(key);
      const bool is_text = value != nullptr && std::holds_alternative<std::string>(*value);
      const std::string cell = FullPrecision(row, key);
      out += (c == 0 ? "" : ",") + (is_text ? EscapeCsv(cell) : cell);
    }
    out += '\n';
  }
  for (const std::string& note : table.notes) out += "# " + EscapeTerminal(note) + '\n';
  return out;
}

std::string ToMarkdown(const Table& table) {
  std::string out =
      table.title.empty() ? "" : fmt::format("## {}\n\n", EscapeMarkdown(table.title));
  const std::vector<TableColumn> columns = ColumnsUnderHeading(table);
  std::string head = "|";
  std::string rule = "|";
  for (const TableColumn& column : columns) {
    head += fmt::format(" {} |", EscapeMarkdown(column.header));
    rule += column.format == Format::kText ? " --- |" : " ---: |";
  }
  bool is_first = true;
  for (const RowGroup& group : Groups(table)) {
    if (!is_first) out += '\n';
    is_first = false;
    if (!group.heading.empty()) out += fmt::format("### {}\n\n", EscapeMarkdown(group.heading));
    out += head + '\n' + rule + '\n';
    for (const Record& row : group.rows) {
      out += '|';
      for (const TableColumn& column : columns) {
        const std::string cell = EscapeMarkdown(Cell(row, column));
        out += cell.empty() ? "  |" : fmt::format(" {} |", cell);
      }
      out += '\n';
    }
  }
  // Each note is its own paragraph; a list would be read as part of the table by some renderers.
  for (const std::string& note : table.notes) {
    out += fmt::format("\n{}\n", EscapeMarkdownParagraph(note));
  }
  return out;
}

}  // namespace loopbench::harness
