#include "mechanism/description/in_space.h"

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
    if (auto* point = std::get_if<PointForce>(&force); point != nullptr) {
      if (!point->in_body_axes) point->force = R * point->force;
    } else if (auto* spring = std::get_if<SpringDamper>(&force); spring != nullptr) {
      for (BodyPoint* end : {&spring->from, &spring->to}) {
        if (end->body == kGround) end->at = R * end->at;
      }
    }
  }
  return spatial;
}

}  // namespace loopbench
