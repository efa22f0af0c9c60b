#include "mechanism/description/in_space.h"

#include <Eigen/Geometry>

#include "mechanism/description/joint_frames.h"

namespace loopbench {

MechanismDescription InSpace(const MechanismDescription& planar, const Eigen::Vector3d& turn) {
  Eigen::Matrix3d R = Eigen::Matrix3d::Identity();
  if (!turn.isZero()) R = Eigen::AngleAxisd(turn.norm(), turn.normalized()).toRotationMatrix();
  MechanismDescription spatial = planar;
  spatial.space = SpaceKind::kSpatial;
  spatial.gravity = R * planar.gravity;
  for (JointDescription& joint : spatial.joints) {
    for (JointSide* side : {&joint.from, &joint.to}) {
      if (side->body != kGround || turn.isZero()) continue;
      const Eigen::AngleAxisd turned(R * PoseOf(*side).R);
      side->rotation = turned.angle() * turned.axis();
      side->position = R * side->position;
    }
  }
  for (ForceDescription& force : spatial.forces) {
    const ForceParts parts = PartsOf(force);
    if (parts.force != nullptr && !*parts.in_body_axes) *parts.force = R * *parts.force;
    for (BodyPoint* point : parts.points) {
      if (point->body == kGround) point->at = R * point->at;
    }
  }
  return spatial;
}

}  // namespace loopbench
