// Findings of `explain` on a structure: idle degrees of freedom, hints on parts that may be
// mistakes, the degrees of freedom that a file expects, and the range of a driven coordinate.
#pragma once

#include <string>
#include <vector>

#include "harness/config/mechanism_reader.h"
#include "mechanism/description/description.h"
#include "mechanism/simplify/structure.h"

namespace loopbench::harness {

/// A spin of bodies about a line that moves no other body: of a rod between two spherical joints
/// about the line of their centres. It is a finite motion. No coordinate of its own describes it.
struct IdleFreedom {
  std::vector<int> bodies;  ///< that turn together
  std::vector<int> joints;  ///< whose points lie on the line
};

/// Returns the idle freedoms of a spatial mechanism at its start, none of a planar one.
///
/// Bodies are grouped by the joints with one speed or less. A group with joints to two or more
/// other bodies may turn about the line of these joints' points, or of a cylindrical one's axis.
/// The spin is idle if all points lie on the line and no constraint forbids it: D^T V = 0 at each
/// of these joints. This needs neither rank nor matrices of the whole.
std::vector<IdleFreedom> FindIdleFreedoms(const MechanismDescription& description,
                                          const Structure& structure);

/// Returns a sentence for each of the freedoms: "spin of rod about the line of its joints A, B".
std::vector<std::string> NamesOf(const MechanismDescription& description,
                                 const std::vector<IdleFreedom>& idle);

/// Radius of gyration over the size of a body beyond which, or below its inverse, units may be
/// mixed. Bodies of usual shapes have 0.1 to 1; g for kg gives 1/30, mm for m 1000 times.
inline constexpr double kOddGyration = 100.0;

/// Returns sentences on unusual parts: bodies that hang by one joint beside
/// loops, and radii of gyration out of proportion with the distances of joints and centres of mass.
std::vector<std::string> FindHints(const MechanismDescription& description,
                                   const Structure& structure);

/// Returns the error message of a mechanism that does not have the expected degrees of freedom,
/// with redundant constraints and idle freedoms; "" if it has them, if nothing is expected, or if
/// the start cannot be assembled, which is an error of its own.
std::string FreedomFault(const MechanismDescription& description, const ObservedQuantities& observe,
                         const Structure& structure);

// Range of a driven coordinate: from the start to the positions beyond which loops do not close.
//
// The coordinate is held and moved in small steps, each from the last position. A step that does
// not close, or that ends far from the last position (on another branch), is halved until it is
// negligible. The gap of the loops grows in proportion to the way beyond a limit, so that limits
// are accurate to a few times the accepted gap, 1e-11 of the mechanism's size.

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
