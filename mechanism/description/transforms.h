// Descriptions of the same mechanism in space or at another size.
#pragma once

#include "mechanism/description/description.h"

namespace loopbench {

/// Returns a planar description as a spatial one whose plane is turned by `turn` (rotation vector
/// [rad]) against the ground's axes. Bodies keep their axes, so their normal is z. Parts not
/// connected to ground start in ground's axes for any turn.
MechanismDescription InSpace(const MechanismDescription& planar, const Eigen::Vector3d& turn);

// A mechanism scaled to another size.

/// Scales all lengths by `factor` > 0, with gravity, forces and springs such that every angle keeps
/// its motion in time. Masses stay, accelerations and forces scale with the factor, moments and
/// moments of inertia with its square. Joint coordinates that are lengths, rods and pitches scale
/// too. Only the ratios of lengths to angles, tolerances and rounding change.
MechanismDescription AtScale(const MechanismDescription& description, double factor);

}  // namespace loopbench
