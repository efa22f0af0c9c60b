// Whether finer tolerances bring a column's runs nearer to one end: what an integrator promises,
// and what a wrong derivative, a tolerance that is not heeded or a motion without an end to
// converge to do not keep.
#pragma once

#include <span>
#include <vector>

#include "harness/record/record.h"

namespace loopbench::harness {

/// Final poses nearer than this, over links and in rad, are alike for rounding's sake: below 1e-11
/// comparisons hold all errors for round-off (harness/judge/rules.h).
inline constexpr double kRoundOffShare = 1e-11;

struct Refinement {
  bool doubted = false;
  /// Largest difference of final poses from those at the column's finest tolerance, and of the run
  /// at the next coarser one; NaN where nothing was compared.
  double off = 0.0, off_before = 0.0;
};

/// One for each record, in their order. Compared are accuracy runs that finished and differ in
/// nothing but the tolerance, of three tolerances at least: distances from the finest run must
/// shrink. One that is still 1000 tolerances away (kMostTolerances) and has not shrunk by even the
/// fourth root of the tolerances' ratio puts the finer runs in doubt; so do two runs of more than a
/// dozen steps that are the same in every bit and step, for then the tolerance had no effect.
std::vector<Refinement> CompareTolerances(std::span<const Record> records);

}  // namespace loopbench::harness
