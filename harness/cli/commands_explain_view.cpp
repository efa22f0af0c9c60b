// Tables of explain on the terminal.
#include <fmt/format.h>

#include <algorithm>

#include "harness/cli/commands_explain.h"
#include "harness/tables/fit.h"
#include "harness/tables/text_column.h"
#include "harness/text/screen.h"
#include "harness/text/terminal.h"

namespace loopbench::harness {

namespace {

constexpr std::size_t kMostRows = 40, kFirstRows = 30, kIndent = 2, kNarrowest = 24;

/// Without columns that say nothing.
Table WithoutEmpty(Table table) {
  std::erase_if(table.columns, [&table](const TableColumn& column) {
    return std::ranges::all_of(table.rows,
                               [&column](const Record& row) { return Cell(row, column).empty(); });
  });
  return table;
}

std::size_t LongestWord(std::string_view text) {
  std::size_t longest = 0;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find(' '), text.size());
    longest = std::max(longest, CellsOf(text.substr(0, end)));
    text.remove_prefix(std::min(end + 1, text.size()));
  }
  return longest;
}

/// For a pipe: only the last column is broken, and no name in it, for somebody may look for it.
Table LastColumnBroken(Table table) {
  TableColumn& last = table.columns.back();
  if (last.format != Format::kText) return table;
  std::size_t taken = kIndent;
  for (std::size_t c = 0; c + 1 < table.columns.size(); ++c) {
    taken += TextColumn(table.columns[c], table.rows).width + kColumnGap;
  }
  constexpr std::size_t kUsual = 100;
  last.most_cells = kUsual > taken + kNarrowest ? kUsual - taken : kNarrowest;
  for (const Record& row : table.rows) {
    last.most_cells = std::max(last.most_cells, LongestWord(EscapeTerminal(row.Text(last.key))));
  }
  return table;
}

Table Fitted(Table table, const ExplainView& view) {
  if (!view.width) return LastColumnBroken(std::move(table));
  return FitWidth(std::move(table),
                  *view.width == 0 ? 0 : *view.width - std::min(*view.width, kIndent));
}

}  // namespace

ExplainView ViewOfOutput(bool all) {
  ExplainView view{.all = all};
  if (OutputIsTerminal()) view.width = OutputScreen().width;
  return view;
}

std::string ShortNumber(double value) { return fmt::format("{:.6g}", value + 0.0); }

void PrintSection(const std::string& title, const Table& table, const ExplainView& view,
                  const char* key) {
  if (view.document != nullptr) {
    std::vector<JsonObject> rows(table.rows.begin(), table.rows.end());
    if (*key != '\0') view.document->Add(key, rows);
    return;
  }
  Print("\n{}\n", title);
  if (table.rows.empty()) {
    Print("  none\n");
    return;
  }
  Table shown = table;
  if (!view.all && table.rows.size() > kMostRows) shown.rows.resize(kFirstRows);
  const std::string text = ToText(Fitted(WithoutEmpty(shown), view));
  for (std::size_t begin = 0; begin < text.size();) {
    const std::size_t end = std::min(text.find('\n', begin), text.size());
    if (end > begin) Print("  {}\n", text.substr(begin, end - begin));
    begin = end + 1;
  }
  if (shown.rows.size() < table.rows.size()) {
    Print("  ... and {} more rows (--all shows them)\n", table.rows.size() - shown.rows.size());
  }
}

}  // namespace loopbench::harness
