// The failure map as tables: for a terminal, for programs, and as a page.
#pragma once

#include <string>
#include <vector>

#include "harness/judge/failure_map.h"
#include "harness/tables/table.h"

namespace loopbench::harness {

/// "24 cells: 15 holds, 3 stopped, 1 inaccurate, 5 not measured".
std::string CountCells(const FailureMap& map);
/// "3 of 877 cells that hold have runs in doubt".
std::string CountDoubts(const FailureMap& map);

/// One row per extreme, one column per method (by letter, named in the notes), coloured by state on
/// a terminal: "ok 2.1e-09", "singular at 0.31 s 3/4", "?" for what was not measured, "-" for what
/// is not applicable.
Table MapTable(const FailureMap& map);

/// One row per cell with all that decided it, every digit: failure-map.csv.
Table MapCellTable(const FailureMap& map);

/// failure-map.md: a table per group, the limits with their reasons, and every cell that does not
/// hold with its number and message. `notes` (provenance) at the end.
std::string MapMarkdown(const FailureMap& map, const std::vector<std::string>& notes);

}  // namespace loopbench::harness
