// Planar mechanisms, described in space.
#pragma once

#include "mechanism/description/description.h"

namespace loopbench {

/// Returns a planar description as a spatial one whose plane is turned by `turn` (rotation vector
/// [rad]) against the ground's axes. Bodies keep their axes, so their normal is z. Parts not
/// connected to ground start in ground's axes for any turn.
MechanismDescription InSpace(const MechanismDescription& planar, const Eigen::Vector3d& turn);

}  // namespace loopbench
