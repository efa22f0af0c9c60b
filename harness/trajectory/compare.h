// Two trajectories of one mechanism beside each other.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "harness/trajectory/check.h"

namespace loopbench::harness {

/// A column that both have.
struct SharedColumn {
  std::string label, unit;
  std::size_t in_ours = 0, in_theirs = 0;
};

/// Columns with the same label, but for the time, in our order.
std::vector<SharedColumn> SharedColumns(const Trajectory& ours, const Trajectory& theirs);

/// Ours at a time, by the cubic through the four rows around it, or the row itself where it has
/// that time; NaN outside.
double ValueAt(const Trajectory& ours, std::size_t column, double t);

/// Theirs minus ours at their times, angles without whole turns; NaN where ours has none.
std::vector<double> Differences(const Trajectory& ours, const Trajectory& theirs,
                                const SharedColumn& column);

}  // namespace loopbench::harness
