#include "mechanism/simplify/attach.h"

#include <Eigen/Geometry>
#include <algorithm>

#include "mechanism/description/islands.h"

namespace loopbench {

namespace {

using Matrix3 = Eigen::Matrix3d;
using Vector3 = Eigen::Vector3d;

/// Inertia of a point mass m at r.
Matrix3 PointInertia(double m, const Vector3& r) {
  return m * (r.squaredNorm() * Matrix3::Identity() - r * r.transpose());
}

void MoveSide(const Attachment& at, SpaceKind space, JointSide* side) {
  side->body = at.carrier;
  side->position = at.X.R * side->position + at.X.p;
  if (space == SpaceKind::kPlanar) {
    side->position.z() = 0.0;
    side->rotation.z() += at.turn;
    return;
  }
  const Eigen::AngleAxisd turned(at.X.R * PoseOf(*side).R);
  side->rotation = turned.angle() * turned.axis();
}

}  // namespace

void AddMass(const BodyDescription& body, const Frame& X, BodyDescription* carrier) {
  const Vector3 com = X.R * body.com + X.p;
  const double mass = carrier->mass + body.mass;
  Vector3 joint_com = carrier->com;
  if (mass > 0.0) joint_com = (carrier->mass * carrier->com + body.mass * com) / mass;
  carrier->inertia += PointInertia(carrier->mass, carrier->com - joint_com) +
                      X.R * body.inertia * X.R.transpose() +
                      PointInertia(body.mass, com - joint_com);
  carrier->inertia = (0.5 * (carrier->inertia + carrier->inertia.transpose())).eval();
  carrier->com = joint_com;
  carrier->mass = mass;
}

MechanismDescription MergeRigidBodies(const MechanismDescription& description,
                                      const std::vector<Attachment>& attachments,
                                      Renumbering* renumbering) {
  MechanismDescription changed = description;
  const std::size_t num_bodies = description.bodies.size();
  std::vector<int> carrier(num_bodies);
  renumbering->bodies.assign(num_bodies, -1);
  int kept = 0;
  for (std::size_t i = 0; i < num_bodies; ++i) {
    const Attachment& at = attachments[i];
    carrier[i] = at.attached ? at.carrier : static_cast<int>(i);
    if (!at.attached) {
      renumbering->bodies[i] = kept++;
      continue;
    }
    BodyDescription& whole = changed.bodies[at.carrier];
    if (at.carrier != kGround) AddMass(description.bodies[i], at.X, &whole);
    for (const auto& [name, p] : description.bodies[i].points) {
      whole.points[description.bodies[i].name + "." + name] = at.X.R * p + at.X.p;
    }
  }
  renumbering->joints.assign(description.joints.size(), -1);
  int joints = 0;
  for (std::size_t j = 0; j < description.joints.size(); ++j) {
    JointDescription& joint = changed.joints[j];
    for (JointSide* side : {&joint.from, &joint.to}) {
      const Attachment& at = attachments[side->body];
      if (at.attached) MoveSide(at, description.space, side);
    }
    if (joint.from.body != joint.to.body) renumbering->joints[j] = joints++;
  }
  for (ForceDescription& force : changed.forces) {
    const ForceParts parts = PartsOf(force);
    for (BodyPoint* point : parts.points) {
      const Attachment& at = attachments[point->body];
      if (!at.attached) continue;
      if (parts.force != nullptr && *parts.in_body_axes) *parts.force = at.X.R * *parts.force;
      *point = {at.carrier, at.X.R * point->at + at.X.p};
    }
  }
  MechanismDescription result = Select(changed, *renumbering);
  for (const Island& island : FindIslands(description)) {
    const int root = island.bodies.front();
    const Vector3& com = description.bodies[root].com;
    if (island.grounded || carrier[root] != root || changed.bodies[root].com == com) continue;
    JointDescription free;
    free.name = description.bodies[root].name;
    free.type = JointType::kFree;
    free.to.body = renumbering->bodies[root];
    free.to.position = com;
    result.joints.push_back(free);
  }
  return result;
}

}  // namespace loopbench
