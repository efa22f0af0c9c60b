// The frames of a joint's two sides, as the description places them on its bodies.
#pragma once

#include "mechanism/algebra/space.h"
#include "mechanism/description/description.h"

namespace loopbench {

/// The frame of a side in body axes, the joint's axis not included.
Pose<Spatial, double> PoseOf(const JointSide& side);

/// Turns a joint's own axis (JointTraits) onto the described one, by the shortest rotation. The
/// joint's frames are those of PoseOf() times this.
Eigen::Matrix3d AxisAlignment(const JointDescription& joint);

}  // namespace loopbench
