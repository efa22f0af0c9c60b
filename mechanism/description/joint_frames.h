// The frames of a joint's two sides, as the description places them on its bodies.
#pragma once

#include <Eigen/Core>

#include "mechanism/description/description.h"

namespace loopbench {

/// Position and orientation of a frame in axes of the user's: of a body, or Ground.
struct Frame {
  Eigen::Matrix3d R = Eigen::Matrix3d::Identity();
  Eigen::Vector3d p = Eigen::Vector3d::Zero();

  /// X_AC from X_AB and X_BC.
  friend Frame operator*(const Frame& X_AB, const Frame& X_BC) {
    return {X_AB.R * X_BC.R, X_AB.p + X_AB.R * X_BC.p};
  }
  /// X_BA from X_AB.
  Frame Inverse() const { return {R.transpose(), -(R.transpose() * p)}; }
};

/// The frame of a side in body axes, the joint's axis not included.
Frame PoseOf(const JointSide& side);

/// Returns the shortest rotation of a joint's own axis (JointTraits) onto the described one. The
/// joint's frames are the frames of PoseOf() times this.
Eigen::Matrix3d AxisAlignment(const JointDescription& joint);

}  // namespace loopbench
