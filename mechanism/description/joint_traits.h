// What a kind of joint is, apart from how it moves: one row per kind. How it moves stands in
// mechanism/model/joint.h, which a test holds to this table.
#pragma once

#include <string_view>

#include "mechanism/description/description.h"

namespace loopbench {

/// Numbers that a user gives for one joint: angles [rad] (or a quaternion; angular velocities
/// [rad/s]) come first, lengths [m] (or [m/s]) follow.
struct ValueCount {
  int angles = 0, lengths = 0;

  int all() const { return angles + lengths; }
};

struct JointTraits {
  std::string_view name;
  bool in_plane = false;  ///< planar scenes may have it
  /// The axis of its own frames that JointDescription::axis names: 'x' (slides along it), 'z'
  /// (turns about it, or is normal to its plane), or '-' for kinds without one.
  char own_axis = '-';
  ValueCount planar, coordinates, speeds;  ///< in the plane; coordinates and speeds in space
};

const JointTraits& TraitsOf(JointType type);

/// Coordinates or speeds of a joint that a user can give: none for a rod, which is never followed.
ValueCount CountValues(JointType type, SpaceKind space, bool speeds);

}  // namespace loopbench
