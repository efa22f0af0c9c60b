// Tables on a terminal: as wide as it is.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "harness/tables/table.h"

namespace loopbench::harness {

/// The columns in the order in which they leave a table that is too wide, as places among
/// ColumnsUnderHeading(): first those that are the same in every row, then the least important
/// (TableColumn::importance; those up to the outcome, which say what a row is, after what was
/// measured), of equals the one furthest to the right. The first column stays.
std::vector<std::size_t> OrderOfLeaving(const Table& table);

/// "dE [J]; t^p; the same in all rows: T/s 10": the columns that have left, by their places, with
/// the values that all rows share.
std::string WhatHasLeft(const Table& table, const std::vector<std::size_t>& places);

/// The table in `width` cells (0: as it is). Texts are broken into lines of no less than 24 cells;
/// where that is not enough, columns leave. The first note names them.
Table FitWidth(Table table, std::size_t width);

/// The table as text for standard output, as wide and as coloured as its screen
/// (harness/text/terminal.h); in a file or a pipe the same as ToText().
std::string ToScreen(const Table& table);

}  // namespace loopbench::harness
