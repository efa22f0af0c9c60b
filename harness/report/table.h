// One table, three writers: terminal text, CSV and Markdown.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "harness/record.h"

namespace loopbench::harness {

/// How the text and Markdown writers print a value. CSV ignores it and keeps every digit.
enum class Format {
  kText,        ///< as it is; left-aligned, all others right-aligned
  kInteger,     ///< 1234
  kShortest,    ///< shortest form that reads back: 1e-06, 10, 0.25
  kScientific,  ///< three digits: 2.05e-03
  kExponent,    ///< two decimals: 1.97
  kFixed,       ///< one decimal: 113.2
  kSeconds,     ///< four significant digits: 0.4213
};

/// One column of a table.
struct TableColumn {
  std::string key;     ///< key in the record, and the column's name in CSV
  std::string header;  ///< heading for people, with the unit in brackets
  Format format = Format::kText;
  /// Shorter words for terminal columns: (value, replacement). Empty in tables that are kept.
  std::vector<std::pair<std::string, std::string>> abbreviations;
};

/// Rows of records under columns. A run that failed is a row like any other, with its outcome and
/// with empty cells for what it did not reach; nothing removes it.
struct Table {
  std::string title;
  std::vector<TableColumn> columns;
  std::vector<Record> rows;
  std::vector<std::string> notes;  ///< provenance and remarks, one line each, below the table
};

/// The cell as the text and Markdown writers print it. Absent and NaN values are empty, never zero;
/// a value that is not a number is printed as it is, whatever the format; a series joins its
/// numbers with ';'.
std::string Cell(const Record& row, const TableColumn& column);

/// Aligned text for a terminal: title, heading, rule, rows, notes. Columns are as wide as their
/// widest cell, two spaces apart, counted in characters rather than bytes.
std::string ToText(const Table& table);

/// RFC 4180: a header of the column keys, then one line per row, quoted where necessary, numbers in
/// the shortest form that reads back to the same bits. Line ends are "\n". Title and notes stay
/// out: the format has no comments, and a reader would take them for rows.
std::string ToCsv(const Table& table);

/// A Markdown table with title and notes; '|' in cells is escaped.
std::string ToMarkdown(const Table& table);

}  // namespace loopbench::harness
