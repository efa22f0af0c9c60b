// The writer for papers: LaTeX that fits the page.
#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <iterator>
#include <optional>

#include "harness/tables/fit.h"
#include "harness/tables/table.h"
#include "harness/text/escape.h"

namespace loopbench::harness {
namespace {

// Of an article on A4 at 10 pt [pt].
constexpr double kTextWidth = 345.0, kTextHeight = 598.0;

/// Ways to set a table, the most comfortable first.
struct Setting {
  const char* size;
  double scale;   ///< of letters, against 10 pt
  double gap_pt;  ///< \tabcolsep, on either side of a column
  bool landscape;
};
constexpr Setting kSettings[] = {{"\\normalsize", 1.0, 6.0, false},
                                 {"\\small", 0.92, 4.0, false},
                                 {"\\footnotesize", 0.85, 3.0, false},
                                 {"\\footnotesize", 0.85, 3.0, true}};
constexpr double kMostOfText = 120.0;  ///< wider texts are broken into lines [pt at 10 pt]

bool IsNumber(const Record& row, const TableColumn& column) {
  const Value* value = row.Find(column.key);
  return value != nullptr &&
         (std::holds_alternative<double>(*value) || std::holds_alternative<std::int64_t>(*value));
}

/// Of Computer Modern at 10 pt, rounded up [pt].
double WidthOfText(std::string_view text) {
  double width = 0.0;
  for (const char c : EscapeTerminal(text)) {
    const auto byte = static_cast<unsigned char>(c);
    if (std::isupper(byte) != 0 || byte >= 0x80) {
      width += 7.8;  // others than Latin letters are written by their numbers, which are longer
    } else {
      width += c == 'm' || c == 'w' || c == '\\' || c == '%' || c == '@' ? 8.4 : 5.1;
    }
  }
  return width;
}

double WidthOfCell(const Record& row, const TableColumn& column) {
  const std::string cell = Cell(row, column);
  const std::size_t e = cell.find('e');
  if (!IsNumber(row, column) || e == std::string::npos) return WidthOfText(EscapeLatex(cell));
  constexpr double kTimesTen = 23.0, kExponentDigit = 4.2, kMinus = 6.5;
  return WidthOfText(cell.substr(0, e)) + kTimesTen + kMinus +
         kExponentDigit * static_cast<double>(cell.size() - e - 2);
}

struct LatexColumn {
  TableColumn column;
  double width = 0.0;  ///< [pt at 10 pt]
  bool is_broken = false;
};

LatexColumn Measured(const Table& table, const TableColumn& column) {
  LatexColumn one{column, WidthOfText(column.header)};
  for (const Record& row : table.rows) one.width = std::max(one.width, WidthOfCell(row, column));
  if (column.format == Format::kText && one.width > kMostOfText) {
    one.width = kMostOfText;
    one.is_broken = true;
  }
  return one;
}

double WidthOf(const std::vector<LatexColumn>& columns, const Setting& setting) {
  double width = 0.0;
  for (const LatexColumn& one : columns) width += setting.scale * one.width + 2.0 * setting.gap_pt;
  return width;
}

/// The first setting that has room.
std::optional<Setting> SettingFor(const std::vector<LatexColumn>& columns) {
  for (const Setting& setting : kSettings) {
    if (WidthOf(columns, setting) <= (setting.landscape ? kTextHeight : kTextWidth)) return setting;
  }
  return std::nullopt;
}

// "2.05e-03?" as $2.05 \times 10^{-3}?$, "113.2" as $113.2$; a text stays a text.
std::string LatexCell(const Record& row, const LatexColumn& shown) {
  std::string cell = Cell(row, shown.column);
  if (cell.empty() || !IsNumber(row, shown.column)) {
    return shown.is_broken ? BreakableLatex(cell) : EscapeLatex(cell);
  }
  const std::size_t end = std::min(cell.find_first_of("?*"), cell.size());
  const std::string marks = cell.substr(end);
  cell.resize(end);
  if (cell.empty()) return EscapeLatex(marks);
  if (cell.find("inf") != std::string::npos)
    return "$" + cell.substr(0, cell[0] == '-') + "\\infty" + marks + "$";
  const std::size_t e = cell.find('e');
  if (e == std::string::npos) return "$" + cell + marks + "$";
  const std::string mantissa = cell.substr(0, e);
  const int exponent = std::stoi(cell.substr(e + 1));
  if (mantissa == "1") return fmt::format("$10^{{{}}}{}$", exponent, marks);
  return fmt::format("${} \\times 10^{{{}}}{}$", mantissa, exponent, marks);
}

std::string LatexRow(const std::vector<std::string>& cells) {
  return fmt::format("{} \\\\\n", fmt::join(cells, " & "));
}

/// "tab:drift", a number behind it for a group.
std::string Label(const Table& table, std::size_t group) {
  std::string slug;
  for (const char c : table.title.empty() ? "records" : table.title) {
    if (std::isalnum(static_cast<unsigned char>(c)) == 0) break;
    slug += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  }
  return fmt::format("tab:{}{}", slug, group == 0 ? "" : fmt::format("-{}", group + 1));
}

std::string Preamble(const std::vector<LatexColumn>& columns, const Setting& setting) {
  std::string preamble;
  for (const LatexColumn& one : columns) {
    if (one.is_broken) {
      preamble +=
          fmt::format(">{{\\raggedright\\arraybackslash}}p{{{:.0f}pt}}", setting.scale * one.width);
    } else {
      preamble += one.column.format == Format::kText ? 'l' : 'r';
    }
  }
  return preamble;
}

}  // namespace

std::string ToLatex(const Table& table) {
  std::vector<LatexColumn> columns;
  for (const TableColumn& column : ColumnsUnderHeading(table)) {
    columns.push_back(Measured(table, column));
  }
  std::vector<std::size_t> left;
  std::vector<LatexColumn> shown = columns;
  for (const std::size_t place : OrderOfLeaving(table)) {
    if (SettingFor(shown)) break;
    left.push_back(place);
    shown.clear();
    for (std::size_t i = 0; i < columns.size(); ++i) {
      if (std::ranges::find(left, i) == left.end()) shown.push_back(columns[i]);
    }
  }
  const Setting setting = SettingFor(shown).value_or(*std::prev(std::end(kSettings)));
  std::vector<std::string> head;
  for (const LatexColumn& one : shown) head.push_back(EscapeLatex(one.column.header));

  std::string out = fmt::format("% needs \\usepackage{{array,booktabs,longtable{}}}\n",
                                setting.landscape ? ",lscape" : "");
  if (!left.empty()) {
    out +=
        fmt::format("% left out to fit the page: {}\n", EscapeTerminal(WhatHasLeft(table, left)));
  }
  const std::string title = table.title.empty() ? "Records" : table.title;
  std::size_t number = 0;
  if (setting.landscape) out += "\\begin{landscape}\n";
  for (const RowGroup& group : Groups(table)) {
    const std::string caption = title + (group.heading.empty() ? "" : ": " + group.heading);
    out += fmt::format(
        "{{{}\\setlength{{\\tabcolsep}}{{{}pt}}\n\\begin{{longtable}}{{{}}}\n"
        "\\caption{{{}}}\\label{{{}}} \\\\\n\\toprule\n{}\\midrule\n\\endfirsthead\n"
        "\\toprule\n{}\\midrule\n\\endhead\n\\bottomrule\n\\endfoot\n",
        setting.size, setting.gap_pt, Preamble(shown, setting), BreakableLatex(caption),
        Label(table, number++), LatexRow(head), LatexRow(head));
    for (const Record& row : group.rows) {
      std::vector<std::string> cells;
      for (const LatexColumn& one : shown) cells.push_back(LatexCell(row, one));
      out += LatexRow(cells);
    }
    out += "\\end{longtable}}\n";
  }
  // remarks belong to the document, the origin of the numbers to its source
  bool is_origin = false;
  for (const std::string& note : table.notes) {
    is_origin = is_origin || note.starts_with("command: ");
    if (is_origin) {
      out += fmt::format("% {}\n", EscapeTerminal(note));
    } else if (!note.empty()) {
      out += fmt::format("{{\\footnotesize\\noindent {}\\par}}\n", BreakableLatex(note));
    }
  }
  if (setting.landscape) out += "\\end{landscape}\n";
  return out;
}

}  // namespace loopbench::harness
