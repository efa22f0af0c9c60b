#include "mechanism/description/joint_frames.h"

#include <Eigen/Geometry>
#include <cmath>

namespace loopbench {

Frame PoseOf(const JointSide& side) {
  Frame X;
  X.p = side.position;
  const double turn = side.rotation.norm();
  if (turn > 0.0) X.R = Eigen::AngleAxisd(turn, side.rotation / turn).toRotationMatrix();
  return X;
}

Eigen::Matrix3d AxisAlignment(const JointDescription& joint) {
  if (joint.axis.isZero()) return Eigen::Matrix3d::Identity();
  const bool along_x = TraitsOf(joint.type).own_axis == 'x';
  const Eigen::Vector3d own = along_x ? Eigen::Vector3d::UnitX() : Eigen::Vector3d::UnitZ();
  const Eigen::Vector3d axis = joint.axis.normalized(), normal = own.cross(axis);
  const double s = normal.norm(), c = own.dot(axis);
  // axis parallel to its own: nothing, or half a turn about y (perpendicular to x and to z)
  if (s == 0.0 && c > 0.0) return Eigen::Matrix3d::Identity();
  const Eigen::Vector3d about = s == 0.0 ? Eigen::Vector3d::UnitY() : Eigen::Vector3d(normal / s);
  return Eigen::AngleAxisd(std::atan2(s, c), about).toRotationMatrix();
}

}  // namespace loopbench
