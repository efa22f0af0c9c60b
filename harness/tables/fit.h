// Fits tables to the width of the terminal.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "harness/tables/table.h"

namespace loopbench::harness {

/// Returns column indices among ColumnsUnderHeading() in drop order for narrow terminals. Constant
/// columns go first, then the least important (TableColumn::importance), the rightmost of equals.
/// Columns up to the outcome, which identify a row, go after measured values. The first column
/// stays.
std::vector<std::size_t> OrderOfLeaving(const Table& table);

/// Returns "dE [J]; t^p; the same in all rows: T/s 10": the dropped columns, by their indices, with
/// the values that all rows share.
std::string DroppedColumnsNote(const Table& table, const std::vector<std::size_t>& places);

/// Fits the table into `width` cells (0: unchanged). Breaks texts into lines of at least 24 cells;
/// if that is not enough, drops columns. The first note names them.
Table FitWidth(Table table, std::size_t width);

/// Returns the table as text for standard output, with the width and colour of its screen
/// (harness/text/terminal.h); for a file or a pipe the text of ToText().
std::string ToScreen(const Table& table);

}  // namespace loopbench::harness
