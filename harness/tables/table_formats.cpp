// The writer for programs, JSON, and the choice among all writers.
#include <fmt/format.h>

#include <algorithm>
#include <stdexcept>
#include <string_view>

#include "harness/record/record_json.h"
#include "harness/tables/columns.h"
#include "harness/tables/table.h"

namespace loopbench::harness {
namespace {

// Columns of lists that machines read: the group's key comes first unless it is one of them.
std::vector<TableColumn> FlatColumns(const Table& table) {
  std::vector<TableColumn> columns = table.columns;
  if (!table.group.empty() &&
      std::ranges::find(columns, table.group, &TableColumn::key) == columns.end()) {
    columns.insert(columns.begin(), ColumnOf(table.group, table.rows));
  }
  return columns;
}

}  // namespace

std::string ToJson(const Table& table) {
  const std::vector<TableColumn> columns = FlatColumns(table);
  const std::string provenance = fmt::format("{}", fmt::join(table.notes, "\n"));
  std::vector<std::string> rows;
  for (const Record& row : table.rows) {
    Record cells;
    for (const TableColumn& column : columns) {
      const Value* value = row.Find(column.key);
      cells.Set(column.key, value == nullptr ? Value() : *value);
    }
    if (!provenance.empty()) cells.Set("provenance", provenance);
    rows.push_back(ToJsonObject(cells));
  }
  return fmt::format("[{}]\n", fmt::join(rows, ",\n"));
}

std::string Render(const Table& table, const std::string& format) {
  if (format == "text") return ToText(table);
  if (format == "markdown") return ToMarkdown(table);
  if (format == "json") return ToJson(table);
  if (format == "latex") return ToLatex(table);
  if (format != "csv") throw std::invalid_argument("no table format " + format);
  Table flat = table;
  flat.columns = FlatColumns(table);
  return ToCsv(flat);
}

}  // namespace loopbench::harness
