// A column as text: digits stand below digits, whether a mark follows them or not.
#pragma once

#include <algorithm>
#include <string>
#include <vector>

#include "harness/tables/table.h"
#include "harness/text/cells.h"
#include "harness/text/escape.h"

namespace loopbench::harness {

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
