// The writers for programs and for papers: JSON and LaTeX.
#include <fmt/format.h>

#include <algorithm>
#include <stdexcept>
#include <string_view>

#include "harness/record/record_json.h"
#include "harness/tables/columns.h"
#include "harness/tables/table.h"
#include "harness/text/escape.h"

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

// "2.05e-03" as $2.05 \times 10^{-3}$, "113.2" as $113.2$; a text stays a text.
std::string LatexCell(const Record& row, const TableColumn& column) {
  const std::string cell = Cell(row, column);
  const Value* value = row.Find(column.key);
  const bool is_number = value != nullptr && (std::holds_alternative<double>(*value) ||
                                              std::holds_alternative<std::int64_t>(*value));
  if (cell.empty() || !is_number) return EscapeLatex(cell);
  if (cell.find("inf") != std::string::npos)
    return "$" + cell.substr(0, cell[0] == '-') + "\\infty$";
  const std::size_t e = cell.find('e');
  if (e == std::string::npos) return "$" + cell + "$";
  const std::string mantissa = cell.substr(0, e);
  const int exponent = std::stoi(cell.substr(e + 1));
  if (mantissa == "1") return fmt::format("$10^{{{}}}$", exponent);
  return fmt::format("${} \\times 10^{{{}}}$", mantissa, exponent);
}

std::string LatexRow(const std::vector<std::string>& cells) {
  return fmt::format("{} \\\\\n", fmt::join(cells, " & "));
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

std::string ToLatex(const Table& table) {
  std::vector<TableColumn> columns = table.columns;
  std::erase_if(columns, [&](const TableColumn& column) { return column.key == table.group; });
  std::string alignment;
  std::vector<std::string> head;
  for (const TableColumn& column : columns) {
    alignment += column.format == Format::kText ? 'l' : 'r';
    head.push_back(EscapeLatex(column.header));
  }
  std::string out = "% needs \\usepackage{booktabs}\n";
  if (!table.title.empty()) out += fmt::format("% {}\n", EscapeTerminal(table.title));
  for (const RowGroup& group : Groups(table)) {
    if (!group.heading.empty()) {
      out += fmt::format("\n\\paragraph{{{}}}\n\n", EscapeLatex(group.heading));
    }
    out += fmt::format("\\begin{{tabular}}{{{}}}\n\\toprule\n{}\\midrule\n", alignment,
                       LatexRow(head));
    for (const Record& row : group.rows) {
      std::vector<std::string> cells;
      for (const TableColumn& column : columns) cells.push_back(LatexCell(row, column));
      out += LatexRow(cells);
    }
    out += "\\bottomrule\n\\end{tabular}\n";
  }
  for (const std::string& note : table.notes) out += fmt::format("% {}\n", EscapeTerminal(note));
  return out;
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
