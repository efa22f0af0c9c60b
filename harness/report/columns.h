// Which columns the tables have, and in which order.
#pragma once

#include <vector>

#include "harness/report/table.h"

namespace loopbench::harness {

/// The columns of drift.csv (docs/design.md, section 6): what was run, how it ended, drift at
/// position [m and rad, never mixed], velocity and acceleration level, energy, growth, counters,
/// conditioning.
/// `loop_closure_max` differs from the drift in absolute coordinates only, where every joint can
/// open and mismatches may cancel around a loop.
const std::vector<TableColumn>& DriftColumns();

/// The columns of timing.csv: what was run and how it ended, the size of the mechanism, then times.
const std::vector<TableColumn>& TimingColumns();

/// The part of DriftColumns() that fits a terminal of some 100 columns, with shortened words.
const std::vector<TableColumn>& CompactDriftColumns();

/// The part of TimingColumns() that fits a terminal of some 100 columns, with shortened words.
const std::vector<TableColumn>& CompactTimingColumns();

}  // namespace loopbench::harness
