// A table, and its formats: text, CSV, Markdown, JSON, LaTeX.
#pragma once

#include <algorithm>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "harness/record/measures.h"
#include "harness/record/record.h"
#include "harness/text/escape.h"

namespace loopbench::harness {

// One table, five writers: terminal text, CSV, Markdown, JSON and LaTeX. Each passes texts through
// the function of its medium in harness/text/escape.h.

/// One column of a table.
struct TableColumn {
  std::string key;     ///< key in the record, and the column's name in CSV
  std::string header;  ///< heading for people, with the unit in brackets
  Format format = Format::kText;
  /// Shorter words for terminal columns: (value, replacement). Empty in tables that are kept.
  std::vector<std::pair<std::string, std::string>> abbreviations = {};
  /// Where a terminal is too narrow the least goes first, of equals the one furthest to the right.
  int importance = 0;
  std::size_t most_cells = 0;  ///< a text is broken into lines of so many cells; 0: it is not
  bool marks_doubts = false;   ///< '*' behind the cells of doubtful runs
};

/// Red for the outcome of a run that failed, yellow for one with doubts.
std::string OutcomeColour(const Record& row, const TableColumn& column);

/// Rows of records under columns. A run that failed is a row like any other, with its outcome and
/// with empty cells for what it did not reach; nothing removes it.
struct Table {
  std::string title = "";
  std::vector<TableColumn> columns = {};
  std::vector<Record> rows = {};
  std::vector<std::string> notes = {};  ///< provenance and remarks, one line each, below the table
  /// Key by whose values the rows are divided ("" for one undivided table). Text, Markdown and
  /// LaTeX write one table per value under a heading; CSV and JSON keep one list with the key as a
  /// column.
  std::string group = "";
  /// The colour of a cell on a terminal, as its SGR number ("31" is red), "" for none.
  std::string (*colour)(const Record& row, const TableColumn& column) = &OutcomeColour;
};

/// Adds a row of `values` under the table's columns, in their order.
void AddRow(const std::vector<Value>& values, Table* table);

/// Rows that share a value of the group's key, under "key = value".
struct RowGroup {
  std::string heading;
  std::vector<Record> rows = {};
};

/// The groups in order of first appearance; one without heading when the table is undivided.
std::vector<RowGroup> Groups(const Table& table);

/// Whether a row's run ended in another way than as it should.
bool HasFailed(const Record& row);

/// Whether the value of `key` is not to be relied on: the outcome of a finished run with `doubts`,
/// an exponent or a law of growth that the row's runs do not resolve. Exponents of energy and
/// corrections come from one run, which resolves none.
bool IsDoubtful(const Record& row, const std::string& key);

/// The cell as the text, Markdown and LaTeX writers print it, with '?' behind a doubtful value,
/// which must not look like a sound one. Absent and NaN values are empty, never zero. A value that
/// is not a number is printed as it is in every format; a series joins its numbers with ';'.
std::string Cell(const Record& row, const TableColumn& column);

/// A number as tables for people have it (Format::kShortest).
std::string NumberCell(double number);

/// The columns under a group's heading: without the group's key, which stands there.
std::vector<TableColumn> ColumnsUnderHeading(const Table& table);

/// Aligned text: title, heading, rule, rows, notes. Columns are as wide as their widest cell, two
/// spaces apart, counted in cells of a terminal (harness/text/escape.h). With `colour` cells have
/// the table's colours; the escape sequences take no place. fit.h makes tables as wide as a
/// terminal.
std::string ToText(const Table& table, bool colour = false);

/// RFC 4180: a header of the column keys, then one line per row, quoted where necessary, numbers in
/// the shortest form that reads back to the same bits. Line ends are "\n". The title stays out.
/// Notes follow as lines that begin with "# ", which RFC 4180 does not know but readers can be told
/// to skip (pandas: comment="#", R: comment.char="#"; gnuplot does by itself). Cells with '#' are
/// quoted.
std::string ToCsv(const Table& table);

/// A Markdown table with title and notes.
std::string ToMarkdown(const Table& table);

/// A JSON array of row objects (pandas.read_json, jq '.[]'): every digit, null for what was not
/// measured, one row per line. The notes, which an array has no other place for, are the last value
/// of every row, "provenance", a text of as many lines.
std::string ToJson(const Table& table);

/// A LaTeX table (array, booktabs, longtable): a longtable per group, numbers in math
/// mode, 2.05e-03 as 2.05 x 10^-3, notes below it; from "command: " on they are comments.
std::string ToLatex(const Table& table);

/// The format's name ("text", "csv", "markdown", "json" or "latex") chooses the writer.
/// @throws std::invalid_argument for any other name.
std::string Render(const Table& table, const std::string& format);

// A column as text: digits stand below digits, whether a mark follows them or not.

inline constexpr std::size_t kColumnGap = 2;  ///< [cells]

struct TextColumn {
  TextColumn(const TableColumn& shown, const std::vector<Record>& rows)
      : column(shown), marked(std::ranges::any_of(rows, [&](const Record& row) {
          return shown.format != Format::kText && IsDoubtful(row, shown.key);
        })) {
    width = CellsOf(EscapeTerminal(column.header));
    for (const Record& row : rows) {
      for (const std::string& line : LinesOf(row)) width = std::max(width, CellsOf(line));
    }
  }

  /// At least one.
  std::vector<std::string> LinesOf(const Record& row) const {
    const std::string cell =
        EscapeTerminal(Cell(row, column)) + (marked && !IsDoubtful(row, column.key) ? " " : "");
    if (column.most_cells == 0) return {cell};
    return BrokenInto(cell, column.most_cells);
  }

  TableColumn column;
  bool marked;
  std::size_t width = 0;  ///< [cells]
};

}  // namespace loopbench::harness
