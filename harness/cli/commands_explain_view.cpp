// Tables of explain on the terminal.
#include <fmt/format.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>

#include "harness/cli/commands_explain.h"
#include "harness/text/terminal.h"

namespace loopbench::harness {

namespace {

constexpr std::size_t kMostRows = 40, kFirstRows = 30, kIndent = 2, kGap = 2, kNarrowest = 24;

/// `text` in pieces of at most `width` bytes where it has room for that, broken behind commas, else
/// at spaces.
std::vector<std::string> Broken(const std::string& text, std::size_t width) {
  std::vector<std::string> pieces;
  std::size_t begin = 0;
  while (text.size() - begin > width) {
    std::size_t end = text.rfind(", ", begin + width - 1);
    end = end == std::string::npos || end <= begin ? text.rfind(' ', begin + width) : end + 1;
    if (end == std::string::npos || end <= begin) end = text.find(' ', begin);
    if (end == std::string::npos) break;
    pieces.push_back(text.substr(begin, end - begin));
    begin = end + 1;
  }
  pieces.push_back(text.substr(begin));
  return pieces;
}

/// Without columns that say nothing.
Table WithoutEmpty(Table table) {
  std::erase_if(table.columns, [&table](const TableColumn& column) {
    return std::ranges::all_of(table.rows,
                               [&column](const Record& row) { return Cell(row, column).empty(); });
  });
  return table;
}

/// The last column in lines of its own, as wide as the others leave it.
Table Fitted(const Table& table, const ExplainView& view) {
  std::size_t taken = kIndent;
  for (std::size_t c = 0; c + 1 < table.columns.size(); ++c) {
    std::size_t widest = table.columns[c].header.size();
    for (const Record& row : table.rows) {
      widest = std::max(widest, Cell(row, table.columns[c]).size());
    }
    taken += widest + kGap;
  }
  const std::size_t room = view.width > taken + kNarrowest ? view.width - taken : kNarrowest;
  Table fitted = table;
  fitted.rows.clear();
  const TableColumn& last = table.columns.back();
  for (const Record& row : table.rows) {
    fitted.rows.push_back(row);
    if (last.format != Format::kText) continue;
    const std::vector<std::string> pieces = Broken(row.Text(last.key), room);
    fitted.rows.back().Set(last.key, pieces.front());
    for (std::size_t i = 1; i < pieces.size(); ++i) {
      fitted.rows.emplace_back().Set(last.key, pieces[i]);
    }
  }
  return fitted;
}

}  // namespace

ExplainView ViewOfTerminal(bool all) {
  ExplainView view{.all = all};
  winsize size{};
  if (::isatty(STDOUT_FILENO) == 1 && ::ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) == 0 &&
      size.ws_col > 0) {
    view.width = size.ws_col;
  }
  return view;
}

std::string ShortNumber(double value) { return fmt::format("{:.6g}", value + 0.0); }

void PrintSection(const std::string& title, const Table& table, const ExplainView& view) {
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
