// The writer for terminals.
#include <algorithm>

#include "harness/tables/table.h"
#include "harness/tables/text_column.h"

namespace loopbench::harness {
namespace {

const std::string kGap(kColumnGap, ' ');

// `text` padded to `width`, on the left for numbers. The last column of text stays unpadded.
std::string Pad(const std::string& text, std::size_t width, Format format) {
  const std::string padding(width - std::min(width, CellsOf(text)), ' ');
  return format == Format::kText ? text + padding : padding + text;
}

void AppendTrimmed(std::string* out, std::string line) {
  line.erase(line.find_last_not_of(' ') + 1);
  *out += line + '\n';
}

void AppendRow(const Table& table, const std::vector<TextColumn>& columns, const Record& row,
               bool colour, std::string* out) {
  std::vector<std::vector<std::string>> cells;
  std::size_t lines = 1;
  for (const TextColumn& shown : columns) {
    lines = std::max(lines, cells.emplace_back(shown.LinesOf(row)).size());
  }
  for (std::size_t line = 0; line < lines; ++line) {
    std::string text;
    for (std::size_t c = 0; c < columns.size(); ++c) {
      const TableColumn& column = columns[c].column;
      std::string cell =
          Pad(line < cells[c].size() ? cells[c][line] : "", columns[c].width, column.format);
      const std::string number = colour ? table.colour(row, column) : "";
      if (!number.empty()) cell = "\033[" + number + "m" + cell + "\033[0m";
      text += (c == 0 ? "" : kGap) + cell;
    }
    AppendTrimmed(out, text);
  }
}

std::string RowsAsText(const Table& table, const std::vector<TextColumn>& columns,
                       const std::vector<Record>& rows, bool colour) {
  std::string heading;
  std::string rule;
  for (const TextColumn& shown : columns) {
    const std::string gap = &shown == columns.data() ? "" : kGap;
    heading += gap + Pad(EscapeTerminal(shown.column.header), shown.width, shown.column.format);
    rule += gap + std::string(shown.width, '-');
  }
  std::string out;
  AppendTrimmed(&out, heading);
  AppendTrimmed(&out, rule);
  for (const Record& row : rows) AppendRow(table, columns, row, colour, &out);
  return out;
}

}  // namespace

std::string ToText(const Table& table, bool colour) {
  std::vector<TextColumn> columns;  // as wide in all groups, so that they compare
  for (const TableColumn& column : ColumnsUnderHeading(table)) {
    columns.emplace_back(column, table.rows);
  }
  std::string out = table.title.empty() ? "" : EscapeTerminal(table.title) + "\n\n";
  bool is_first = true;
  for (const RowGroup& group : Groups(table)) {
    if (!is_first) out += '\n';
    is_first = false;
    if (!group.heading.empty()) out += EscapeTerminal(group.heading) + "\n\n";
    out += RowsAsText(table, columns, group.rows, colour);
  }
  if (!table.notes.empty()) out += '\n';
  for (const std::string& note : table.notes) out += EscapeTerminal(note) + '\n';
  return out;
}

}  // namespace loopbench::harness
