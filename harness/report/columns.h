// Which columns the tables have, and in which order.
#pragma once

#include <vector>

#include "harness/report/table.h"

namespace loopbench::harness {

/// The columns of drift.csv (docs/design.md, section 6): what was run, how it ended, drift at
/// position [m and rad, never mixed], velocity and acceleration level, energy, growth, counters,
/// conditioning. `joint_mismatch_max` is the largest mismatch of a single joint; it differs from
/// the loop closure in absolute coordinates, where every joint can open.
const std::vector<Column>& DriftColumns();

/// The columns of timing.csv: what was run and how it ended, the size of the mechanism, then times.
const std::vector<Column>& TimingColumns();

/// The part of DriftColumns() that fits a terminal of some 100 columns, with shortened words.
const std::vector<Column>& CompactDriftColumns();

/// The part of TimingColumns() that fits a terminal of some 100 columns, with shortened words.
const std::vector<Column>& CompactTimingColumns();

}  // namespace loopbench::harness
