// Assembly branches: all positions that close the loops with the fixed coordinates of a start.
//
// Scattered starts: free coordinates are uniform random numbers (angles within half a turn, lengths
// within pi mean links). Each start goes to a closed position by Levenberg-Marquardt (closure.h),
// which leads to the branch in whose basin it lies. Positions are equal if all bodies have equal
// poses. A search finds a branch of share p of all starts with probability 1 - (1 - p)^starts.
#pragma once

#include <vector>

#include "mechanism/description/description.h"

namespace loopbench {

struct Branch {
  MechanismDescription description;  ///< with the branch as its start, closed to round-off
  int times = 0;                     ///< number of starts that led here
  double distance = 0.0;             ///< largest difference of a body's pose from the first
                                     ///< branch's [rad, or mean links]
};

struct Branches {
  /// Motions that remain with the fixed coordinates: branches are isolated only if it is 0.
  int freedom = 0;
  int movable = 0;             ///< starts that led to other positions in which a motion remains
  int starts = 0, closed = 0;  ///< scattered starts, and those that closed
  std::vector<Branch> found;   ///< the description's own start first, then by distance from it
};

/// Finds branches from `starts` scattered starts, the same ones each time. Stops at the first if
/// motions remain. Throws std::invalid_argument with the reason if the description's own start
/// cannot be assembled.
Branches FindBranches(const MechanismDescription& description, int starts);

}  // namespace loopbench
