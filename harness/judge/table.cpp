#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdint>
#include <functional>
#include <iterator>
#include <numeric>
#include <optional>
#include <stdexcept>
#include <string_view>

#include "harness/base/record.h"
#include "harness/base/text.h"
#include "harness/judge/tables.h"

namespace loopbench::harness {
namespace {

std::string FormatNumber(double number, Format format) {
  if (std::isnan(number)) return "";
  // in the order of Format
  constexpr const char* kFormats[] = {"", "{:.0f}", "", "{:.2e}", "{:.2f}", "{:.1f}", "{:.4g}"};
  const std::string_view digits = kFormats[static_cast<std::size_t>(format)];
  return digits.empty() ? NumberCell(number) : fmt::format(fmt::runtime(digits), number);
}

// Returns every digit, for CSV: absent and NaN values are empty as in the other writers.
std::string FullPrecision(const Record& row, const std::string& key) {
  const Value* value = row.Find(key);
  if (value == nullptr) return "";
  if (const auto* series = std::get_if<std::vector<double>>(value)) {
    return fmt::format("{}", fmt::join(*series, ";"));
  }
  if (const auto* number = std::get_if<double>(value); number != nullptr && std::isnan(*number)) {
    return "";
  }
  return row.Text(key);
}

std::vector<TableColumn> ColumnsUnderHeading(const Table& table) {
  std::vector<TableColumn> columns = table.columns;
  std::erase_if(columns, [&](const TableColumn& column) { return column.key == table.group; });
  return columns;
}

// Returns columns of machine-readable lists: the group's key comes first unless it is a column.
std::vector<TableColumn> FlatColumns(const Table& table) {
  std::vector<TableColumn> columns = table.columns;
  if (!table.group.empty() && !Contains(columns, table.group, &TableColumn::key)) {
    columns.insert(columns.begin(), ColumnOf(table.group, table.rows));
  }
  return columns;
}

using RowGroup = std::pair<std::string, std::vector<Record>>;

/// Returns the rows by the value of the group's key, under "key = value"; without a heading if the
/// table is undivided.
std::vector<RowGroup> Groups(const Table& table) {
  if (table.group.empty()) return {{"", table.rows}};
  return GroupBy(table.rows, [&](const Record& row) {
    const std::string cell = Cell(row, {table.group, table.group, Format::kShortest});
    return fmt::format("{} = {}", table.group, cell.empty() ? "(none)" : cell);
  });
}

/// Returns the text of each group, with an empty line between them; `heading` writes its heading.
std::string TextOfGroups(const Table& table,
                         const std::function<std::string(const std::string&)>& heading,
                         const std::function<std::string(const std::vector<Record>&)>& rows) {
  return Joined(Groups(table), "\n", [&](const RowGroup& group) {
    return (group.first.empty() ? "" : heading(group.first) + "\n\n") + rows(group.second);
  });
}

}  // namespace

std::string NumberCell(double number) {
  // a number with more digits than people write is computed
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

std::string Cell(const Record& row, const TableColumn& column) {
  const Value* value = row.Find(column.key);
  std::string mark = value != nullptr && IsFlagged(row, column.key) ? "?" : "";
  if (column.marks_warnings && IsFlagged(row, "outcome")) mark += '*';
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

Record& AddRow(std::initializer_list<AnyValue> values, Table* table) {
  Record& row = table->rows.emplace_back();
  std::size_t column = 0;
  for (const AnyValue& one : values) row.Set(table->columns.at(column++).key, one.value);
  return row;
}

std::string ToCsv(const Table& table) {
  std::string out =
      Joined(table.columns, ",", [](const TableColumn& column) { return EscapeCsv(column.key); }) +
      '\n';
  for (const Record& row : table.rows) {
    out += Joined(table.columns, ",",
                  [&row](const TableColumn& column) {
                    const Value* value = row.Find(column.key);
                    const bool is_text =
                        value != nullptr && std::holds_alternative<std::string>(*value);
                    const std::string cell = FullPrecision(row, column.key);
                    return is_text ? EscapeCsv(cell) : cell;
                  }) +
           '\n';
  }
  for (const std::string& note : table.notes) out += "# " + EscapeTerminal(note) + '\n';
  return out;
}

std::string ToMarkdown(const Table& table) {
  std::string out =
      table.title.empty() ? "" : fmt::format("## {}\n\n", EscapeMarkdown(table.title));
  const std::vector<TableColumn> columns = ColumnsUnderHeading(table);
  std::string head = "|", rule = "|";
  for (const TableColumn& column : columns) {
    head += fmt::format(" {} |", EscapeMarkdown(column.header));
    rule += column.format == Format::kText ? " --- |" : " ---: |";
  }
  const auto heading = [](const std::string& words) { return "### " + EscapeMarkdown(words); };
  out += TextOfGroups(table, heading, [&](const std::vector<Record>& rows) {
    std::string text = head + '\n' + rule + '\n';
    for (const Record& row : rows) {
      text += '|';
      for (const TableColumn& column : columns) {
        const std::string cell = EscapeMarkdown(Cell(row, column));
        text += cell.empty() ? "  |" : fmt::format(" {} |", cell);
      }
      text += '\n';
    }
    return text;
  });
  // each note is a paragraph; some renderers read a list as part of the table
  for (const std::string& note : table.notes) {
    out += fmt::format("\n{}\n", EscapeMarkdownParagraph(note));
  }
  return out;
}

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

namespace {

/// Column as text: digits are aligned, with or without a mark after them.
struct TextColumn {
  TextColumn(const TableColumn& shown, const std::vector<Record>& rows)
      : column(shown), marked(std::ranges::any_of(rows, [&](const Record& row) {
          return shown.format != Format::kText && IsFlagged(row, shown.key);
        })) {
    width = CellsOf(EscapeTerminal(column.header));
    for (const Record& row : rows) {
      for (const std::string& line : LinesOf(row)) width = std::max(width, CellsOf(line));
    }
  }

  std::vector<std::string> LinesOf(const Record& row) const {
    const std::string cell =
        EscapeTerminal(Cell(row, column)) + (marked && !IsFlagged(row, column.key) ? " " : "");
    if (column.most_cells == 0) return {cell};
    return BrokenInto(cell, column.most_cells);
  }

  TableColumn column;
  bool marked;
  std::size_t width = 0;  ///< [cells]
};

bool IsSameInAllRows(const Table& table, const TableColumn& column) {
  return table.rows.size() > 1 && std::ranges::all_of(table.rows, [&](const Record& row) {
           return Cell(row, column) == Cell(table.rows.front(), column);
         });
}

/// Returns column indices among ColumnsUnderHeading() in drop order (FitWidth()).
std::vector<std::size_t> OrderOfLeaving(const Table& table) {
  const std::vector<TableColumn> columns = ColumnsUnderHeading(table);
  const auto outcome = std::ranges::find(columns, "outcome", &TableColumn::key);
  const auto rank = [&](std::size_t place) {
    int importance = columns[place].importance;
    if (outcome != columns.end() && columns.begin() + static_cast<std::ptrdiff_t>(place) <= outcome)
      ++importance;
    if (columns[place].key == "outcome") ++importance;
    return std::pair(!IsSameInAllRows(table, columns[place]), importance);
  };
  std::vector<std::size_t> places(columns.empty() ? 0 : columns.size() - 1);
  std::iota(places.rbegin(), places.rend(), std::size_t{1});
  std::ranges::stable_sort(places, {}, rank);
  return places;
}

/// Returns "dE [J]; t^p; the same in all rows: T/s 10": the dropped columns, by their indices, with
/// the values that all rows share.
std::string DroppedColumnsNote(const Table& table, std::vector<std::size_t> places) {
  const std::vector<TableColumn> columns = ColumnsUnderHeading(table);
  std::vector<std::string> gone, same;
  std::ranges::sort(places);
  for (const std::size_t place : places) {
    const TableColumn& column = columns[place];
    const std::string value = Cell(table.rows.front(), column);
    const bool is_same = !value.empty() && IsSameInAllRows(table, column);
    (is_same ? same : gone).push_back(is_same ? column.header + " " + value : column.header);
  }
  if (!same.empty()) gone.push_back("the same in all rows: " + Joined(same, "; "));
  return Joined(gone, "; ");
}

/// Column with its preferred and its smallest width [cells].
struct Fitting {
  std::size_t widest = 0, narrowest = 0;
  bool stays = true;
};

std::size_t Taken(const std::vector<Fitting>& columns, std::size_t Fitting::*width) {
  std::size_t sum = 0;
  for (const Fitting& one : columns) {
    if (one.stays) sum += (sum > 0 ? kColumnGap : 0) + one.*width;
  }
  return sum;
}

}  // namespace

std::size_t TextWidth(const TableColumn& column, const std::vector<Record>& rows) {
  return TextColumn(column, rows).width;
}

Table FitWidth(Table table, std::size_t width) {
  constexpr std::size_t kNarrowestText = 24;  // [cells]: a few words; headings are not broken
  const std::vector<TableColumn> columns = ColumnsUnderHeading(table);
  std::vector<Fitting> fittings = Mapped<Fitting>(columns, [&](const TableColumn& column) {
    const std::size_t widest = TextWidth(column, table.rows);
    if (column.format != Format::kText) return Fitting{widest, widest};
    return Fitting{widest, std::max(CellsOf(EscapeTerminal(column.header)),
                                    std::min({widest, kNarrowestText, width}))};
  });
  if (width == 0 || Taken(fittings, &Fitting::widest) <= width) return table;
  std::vector<std::size_t> left;
  for (const std::size_t place : OrderOfLeaving(table)) {
    if (Taken(fittings, &Fitting::narrowest) <= width) break;
    fittings[place].stays = false;
    left.push_back(place);
  }
  if (!left.empty()) {
    table.notes.insert(table.notes.begin(),
                       fmt::format("left out for a width of {} (--wide shows all): {}", width,
                                   DroppedColumnsNote(table, left)));
  }
  std::size_t room = width - std::min(width, Taken(fittings, &Fitting::narrowest));
  table.columns.clear();
  for (std::size_t place = 0; place < columns.size(); ++place) {
    const Fitting& one = fittings[place];
    if (!one.stays) continue;
    const std::size_t more = std::min(room, one.widest - one.narrowest);
    room -= more;
    table.columns.push_back(columns[place]);
    if (one.narrowest + more < one.widest) table.columns.back().most_cells = one.narrowest + more;
  }
  return table;
}

std::string ToScreen(const Table& table) {
  const Screen screen = OutputScreen();
  return ToText(FitWidth(table, screen.width), screen.colour);
}

// LaTeX writer: tables that fit the page.

namespace {

// Text size of an article on A4 at 10 pt [pt].
constexpr double kTextWidth = 345.0, kTextHeight = 598.0;

/// Ways to set a table, in order of decreasing legibility.
struct Setting {
  const char* size;
  double scale;   ///< of letters, relative to 10 pt
  double gap_pt;  ///< \tabcolsep, on either side of a column
  bool landscape;
};
constexpr Setting kSettings[] = {{"\\normalsize", 1.0, 6.0, false},
                                 {"\\small", 0.92, 4.0, false},
                                 {"\\footnotesize", 0.85, 3.0, false},
                                 {"\\footnotesize", 0.85, 3.0, true}};
constexpr double kMaxOfText = 120.0;  ///< wider texts are broken into lines [pt at 10 pt]

bool IsNumber(const Record& row, const TableColumn& column) {
  const Value* value = row.Find(column.key);
  return value != nullptr &&
         (std::holds_alternative<double>(*value) || std::holds_alternative<std::int64_t>(*value));
}

/// Returns the width in Computer Modern at 10 pt, rounded up [pt].
double WidthOfText(std::string_view text) {
  double width = 0.0;
  for (const char c : EscapeTerminal(text)) {
    const auto byte = static_cast<unsigned char>(c);
    const bool is_wide = std::isupper(byte) != 0 || byte >= 0x80;
    // non-Latin letters are written as numbers, which are longer
    width += is_wide                                                        ? 7.8
             : std::string_view("mw\\%@").find(c) != std::string_view::npos ? 8.4
                                                                            : 5.1;
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

LatexColumn LatexColumnOf(const Table& table, const TableColumn& column) {
  LatexColumn one{column, WidthOfText(column.header)};
  for (const Record& row : table.rows) one.width = std::max(one.width, WidthOfCell(row, column));
  if (column.format == Format::kText && one.width > kMaxOfText) {
    one.width = kMaxOfText;
    one.is_broken = true;
  }
  return one;
}

std::optional<Setting> SettingFor(const std::vector<LatexColumn>& columns) {
  for (const Setting& setting : kSettings) {
    double width = 0.0;
    for (const LatexColumn& one : columns) {
      width += setting.scale * one.width + 2.0 * setting.gap_pt;
    }
    if (width <= (setting.landscape ? kTextHeight : kTextWidth)) return setting;
  }
  return std::nullopt;
}

// Returns $2.05 \times 10^{-3}?$ for "2.05e-03?", $113.2$ for "113.2"; texts stay unchanged.
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

/// Returns "tab:drift", followed by a number for a group.
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
  const std::vector<LatexColumn> columns =
      Mapped<LatexColumn>(ColumnsUnderHeading(table),
                          [&](const TableColumn& column) { return LatexColumnOf(table, column); });
  std::vector<LatexColumn> shown = columns;
  std::vector<std::size_t> left;
  for (const std::size_t place : OrderOfLeaving(table)) {
    if (SettingFor(shown)) break;
    left.push_back(place);
    shown.clear();
    for (std::size_t i = 0; i < columns.size(); ++i) {
      if (!Contains(left, i)) shown.push_back(columns[i]);
    }
  }
  const Setting setting = SettingFor(shown).value_or(*std::prev(std::end(kSettings)));
  const std::string head = LatexRow(Mapped<std::string>(
      shown, [](const LatexColumn& one) { return EscapeLatex(one.column.header); }));

  std::string out = fmt::format("% needs \\usepackage{{array,booktabs,longtable{}}}\n",
                                setting.landscape ? ",lscape" : "");
  if (!left.empty()) {
    out += fmt::format("% left out to fit the page: {}\n",
                       EscapeTerminal(DroppedColumnsNote(table, left)));
  }
  const std::string title = table.title.empty() ? "Records" : table.title;
  std::size_t number = 0;
  if (setting.landscape) out += "\\begin{landscape}\n";
  for (const auto& [heading, rows] : Groups(table)) {
    const std::string caption = title + (heading.empty() ? "" : ": " + heading);
    out += fmt::format(
        "{{{}\\setlength{{\\tabcolsep}}{{{}pt}}\n\\begin{{longtable}}{{{}}}\n"
        "\\caption{{{}}}\\label{{{}}} \\\\\n\\toprule\n{}\\midrule\n\\endfirsthead\n"
        "\\toprule\n{}\\midrule\n\\endhead\n\\bottomrule\n\\endfoot\n",
        setting.size, setting.gap_pt, Preamble(shown, setting), BreakableLatex(caption),
        Label(table, number++), head, head);
    for (const Record& row : rows) {
      out += LatexRow(Mapped<std::string>(
          shown, [&row](const LatexColumn& one) { return LatexCell(row, one); }));
    }
    out += "\\end{longtable}}\n";
  }
  // remarks go into the document, the provenance into its source
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

// The writer for terminals.

namespace {

const std::string kGap(kColumnGap, ' ');

// Pads `text` to `width`, on the left for numbers. The last column of text stays unpadded.
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

}  // namespace

std::string ToText(const Table& table, bool colour) {
  std::string names, rule;
  std::vector<TextColumn> columns;  // equal widths in all groups, for comparison
  for (const TableColumn& column : ColumnsUnderHeading(table)) {
    const std::string gap = columns.empty() ? "" : kGap;
    const std::size_t width = columns.emplace_back(column, table.rows).width;
    names += gap + Pad(EscapeTerminal(column.header), width, column.format);
    rule += gap + std::string(width, '-');
  }
  std::string out = table.title.empty() ? "" : EscapeTerminal(table.title) + "\n\n";
  out += TextOfGroups(table, EscapeTerminal, [&](const std::vector<Record>& rows) {
    std::string text;
    AppendTrimmed(&text, names);
    AppendTrimmed(&text, rule);
    for (const Record& row : rows) AppendRow(table, columns, row, colour, &text);
    return text;
  });
  if (!table.notes.empty()) out += '\n';
  for (const std::string& note : table.notes) out += EscapeTerminal(note) + '\n';
  return out;
}

}  // namespace loopbench::harness
