// A table, and its formats: text, CSV, Markdown, JSON, LaTeX.
#pragma once

#include <algorithm>
#include <cstdint>
#include <initializer_list>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include "harness/record/measures.h"
#include "harness/record/record.h"
#include "harness/text/escape.h"

namespace loopbench::harness {

// One table, five writers: terminal text, CSV, Markdown, JSON and LaTeX. Each escapes texts with
// the function of its medium in harness/text/escape.h.

/// One column of a table.
struct TableColumn {
  std::string key;     ///< key in the record, and the column's name in CSV
  std::string header;  ///< heading for people, with the unit in brackets
  Format format = Format::kText;
  /// Shorter words for terminal columns: (value, replacement). Empty in tables for files.
  std::vector<std::pair<std::string, std::string>> abbreviations = {};
  /// Columns of least importance are dropped first on narrow terminals, the rightmost of equals.
  int importance = 0;
  std::size_t most_cells = 0;   ///< width at which a text is broken into lines; 0: never
  bool marks_warnings = false;  ///< '*' after the cells of runs with warnings
};

/// Returns red for the outcome of a failed run, yellow for an outcome with warnings.
std::string OutcomeColour(const Record& row, const TableColumn& column);

/// Rows of records under columns. A failed run is an ordinary row with its outcome and empty cells
/// for missing values; nothing removes it.
struct Table {
  std::string title = "";
  std::vector<TableColumn> columns = {};
  std::vector<Record> rows = {};
  std::vector<std::string> notes = {};  ///< provenance and remarks, one line each, below the table
  /// Key whose values divide the rows ("" for one undivided table). Text, Markdown and LaTeX write
  /// one table per value under a heading. CSV and JSON keep one list with the key as a column.
  std::string group = "";
  /// Colour of a cell on a terminal, as its SGR number ("31" is red), "" for none.
  std::string (*colour)(const Record& row, const TableColumn& column) = &OutcomeColour;
};

/// Value of a cell: a text of any type, a number, a count, a word of an enumeration, or a value.
struct AnyValue {
  template <class T>
  AnyValue(const T& any) {
    if constexpr (std::is_convertible_v<const T&, std::string_view>) {
      value = std::string(std::string_view(any));
    } else if constexpr (std::is_same_v<T, bool> || std::is_convertible_v<const T*, const Value*>) {
      value = any;
    } else if constexpr (std::is_integral_v<T>) {
      value = static_cast<std::int64_t>(any);
    } else if constexpr (requires { any.string(); }) {
      value = any.string();
    } else if constexpr (requires { ToString(any); }) {
      value = std::string(ToString(any));
    } else {
      value = Value(any);
    }
  }
  Value value;
};

/// Adds a row of `values` under the table's columns, in their order; fewer values leave the last
/// columns empty.
Record& AddRow(std::initializer_list<AnyValue> values, Table* table);

/// Rows with one value of the group's key, under "key = value".
struct RowGroup {
  std::string heading;
  std::vector<Record> rows = {};
};

/// Returns the groups in order of first appearance; one without heading if the table is undivided.
std::vector<RowGroup> Groups(const Table& table);

/// True if the run of a row did not end with its expected outcome.
bool HasFailed(const Record& row);

/// True if the value of `key` is unreliable: the outcome of a finished run with `warnings`, or an
/// unresolved exponent or law of growth. Exponents of energy and corrections come from one run,
/// which resolves none.
bool IsFlagged(const Record& row, const std::string& key);

/// Returns the cell for text, Markdown and LaTeX, with '?' after a flagged value. Absent and NaN
/// values are empty, never zero. A value that is not a number is printed unchanged in every format;
/// a series joins its numbers with ';'.
std::string Cell(const Record& row, const TableColumn& column);

/// Formats a number for people (Format::kShortest).
std::string NumberCell(double number);

/// Returns the columns under a group's heading: without the group's key, which the heading shows.
std::vector<TableColumn> ColumnsUnderHeading(const Table& table);

/// Writes aligned text: title, heading, rule, rows, notes. Columns are as wide as their widest
/// cell, two spaces apart, counted in cells of a terminal (harness/text/escape.h). With `colour`
/// cells have the table's colours; escape sequences have no width. fit.h fits tables to a terminal.
std::string ToText(const Table& table, bool colour = false);

/// Writes RFC 4180: a header of the column keys, then one line per row, quoted if necessary.
/// Numbers have the shortest form that reads back to the same bits. Line ends are "\n". There is no
/// title. Notes follow as lines that begin with "# ", which RFC 4180 does not define. Readers can
/// skip them (pandas: comment="#", R: comment.char="#"; gnuplot by default). Cells with '#' are
/// quoted.
std::string ToCsv(const Table& table);

/// Writes a Markdown table with title and notes.
std::string ToMarkdown(const Table& table);

/// Writes a JSON array of row objects, one per line, for pandas.read_json or jq '.[]'. Numbers have
/// every digit; null means not measured. The notes, for which an array has no other place, are the
/// last value of every row: "provenance", a text with one line per note.
std::string ToJson(const Table& table);

/// Writes a LaTeX table (array, booktabs, longtable): a longtable per group, numbers in math mode,
/// 2.05e-03 as 2.05 x 10^-3, notes below it; from "command: " on they are comments.
std::string ToLatex(const Table& table);

/// Writes the format with this name: "text", "csv", "markdown", "json" or "latex".
/// @throws std::invalid_argument for any other name.
std::string Render(const Table& table, const std::string& format);

// Column as text: digits are aligned, with or without a mark after them.

inline constexpr std::size_t kColumnGap = 2;  ///< [cells]

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

  /// Returns at least one line.
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

}  // namespace loopbench::harness
