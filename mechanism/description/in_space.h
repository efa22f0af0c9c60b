// Planar mechanisms, described in space.
#pragma once

#include "mechanism/description/description.h"

namespace loopbench {

/// A planar description as a spatial one whose plane is turned by `turn` (rotation vector [rad])
/// against the ground's axes. Bodies keep their axes, so their normal is z. Parts that do not reach
/// ground start in ground's axes as ever, whatever the turn.
MechanismDescription InSpace(const MechanismDescription& planar, const Eigen::Vector3d& turn);

}  // namespace loopbench
