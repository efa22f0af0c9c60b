// Range of a driven coordinate: from the start to the positions beyond which loops do not close.
//
// The coordinate is held and moved in small steps, each from the last position. A step that does
// not close, or that ends far from the last position (on another branch), is halved until it is
// negligible. The gap of the loops grows in proportion to the way beyond a limit, so that limits
// are accurate to a few times the accepted gap, 1e-11 of the mechanism's size.
#pragma once

#include <string>
#include <vector>

#include "mechanism/description/description.h"

namespace loopbench::harness {

struct RangeEnd {
  double value = 0.0;       ///< [rad] or [m]
  bool binds = false;       ///< else the search ended: a turn, or ten lengths from the start
  MechanismDescription at;  ///< with this position as its start
  /// Pairs of bodies that are in line there, and their joint: "rod and rocker at B".
  std::vector<std::string> in_line;
};

struct CoordinateRange {
  std::string why;  ///< why there is none; else empty
  double start = 0.0;
  RangeEnd low, high;
};

/// `joint` has one coordinate; a motion of the file is ignored. All other motions, except idle
/// ones, must follow from it and from "fixed" joints.
CoordinateRange FindRange(MechanismDescription description, int joint);

}  // namespace loopbench::harness
