// A planar description, written in space as inconveniently as one may.
#pragma once

#include <cmath>

#include "mechanism/description/transforms.h"
#include "mechanism/simplify/attach.h"
#include "tests/contract/generators.h"

namespace loopbench::testing {

inline Eigen::Vector3d TurnVector(const Eigen::Matrix3d& R) {
  const Eigen::AngleAxisd turn(R);
  return turn.angle() * turn.axis();
}

/// The same mechanism in a tilted plane: each body with its own axes and origin, each joint at a
/// height of its own, its frames upside down at times. Coordinates keep their values but for the
/// angle of a slot whose frames were turned over. Every part must reach ground.
inline MechanismDescription Scramble(const MechanismDescription& planar, std::uint64_t seed) {
  Random random(seed);
  MechanismDescription d = InSpace(planar, random.Vector(1.5, true));
  const Eigen::Matrix3d over = Eigen::Vector3d(1.0, -1.0, -1.0).asDiagonal();
  for (std::size_t j = 0; j < d.joints.size(); ++j) {
    JointDescription& joint = d.joints[j];
    // ground has no height to give: there the joint stays level with the ground's origin
    const bool grounded = joint.from.body == kGround || joint.to.body == kGround;
    const double height = grounded ? 0.0 : random.Uniform(-1.0, 1.0);
    joint.from.position.z() += height;
    joint.to.position.z() += height;
    const bool turns = joint.type == JointType::kRevolute || joint.type == JointType::kPinInSlot;
    if (!turns || !joint.axis.isZero() || !random.Chance(0.5)) continue;
    for (JointSide* side : {&joint.from, &joint.to}) {
      side->rotation = TurnVector(PoseOf(*side).R * over);
    }
    if (joint.type == JointType::kRevolute) std::swap(joint.from, joint.to);
    if (joint.type != JointType::kPinInSlot) continue;
    for (JointValues& values : d.initial.coordinates) {
      if (values.joint == static_cast<int>(j)) values.values[0] = -values.values[0];
    }
  }
  // bodies in axes of their own
  for (int b = 1; b < static_cast<int>(d.bodies.size()); ++b) {
    const Eigen::Vector3d turn = random.Vector(2.0, true), origin = random.Vector(1.0, true);
    const Eigen::Matrix3d R =
        Eigen::AngleAxisd(turn.norm(), turn.normalized()).toRotationMatrix();  // old from new
    BodyDescription& body = d.bodies[b];
    body.com = R.transpose() * (body.com - origin);
    body.inertia = R.transpose() * body.inertia * R;
    body.inertia = (0.5 * (body.inertia + body.inertia.transpose())).eval();
    for (JointDescription& joint : d.joints) {
      for (JointSide* side : {&joint.from, &joint.to}) {
        if (side->body != b) continue;
        const Eigen::Matrix3d frame = R.transpose() * PoseOf(*side).R;
        side->rotation = TurnVector(frame);
        side->position = R.transpose() * (side->position - origin);
      }
    }
    for (ForceDescription& force : d.forces) {
      const ForceParts parts = PartsOf(force);
      for (BodyPoint* point : parts.points) {
        if (point->body != b) continue;
        point->at = R.transpose() * (point->at - origin);
        if (parts.force != nullptr && *parts.in_body_axes)
          *parts.force = R.transpose() * *parts.force;
      }
    }
  }
  return d;
}

}  // namespace loopbench::testing
