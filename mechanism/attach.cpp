#include "mechanism/attach.h"

#include <algorithm>

#include "mechanism/islands.h"

namespace loopbench {

namespace {

using Matrix3 = Eigen::Matrix3d;
using Vector3 = Eigen::Vector3d;

struct IsKnown {
  bool operator()(const JointTorque&) const { return true; }
  bool operator()(const JointSpring&) const { return true; }
  bool operator()(const JointDamper&) const { return true; }
  bool operator()(const PointForce&) const { return true; }
  bool operator()(const SpringDamper&) const { return true; }
  bool operator()(const Drag&) const { return true; }
  template <class Other>
  bool operator()(const Other&) const {
    return false;
  }
};

/// Inertia of a point mass m at r.
Matrix3 PointInertia(double m, const Vector3& r) {
  return m * (r.squaredNorm() * Matrix3::Identity() - r * r.transpose());
}

/// The carrier with the mass of another body, given by its place.
void AddMass(const BodyDescription& body, const Pose<Spatial, double>& X,
             BodyDescription* carrier) {
  const Vector3 com = X.R * body.com + X.p;
  const double mass = carrier->mass + body.mass;
  const Vector3 joint_com = (carrier->mass * carrier->com + body.mass * com) / mass;
  carrier->inertia += PointInertia(carrier->mass, carrier->com - joint_com) +
                      X.R * body.inertia * X.R.transpose() +
                      PointInertia(body.mass, com - joint_com);
  carrier->inertia = (0.5 * (carrier->inertia + carrier->inertia.transpose())).eval();
  carrier->com = joint_com;
  carrier->mass = mass;
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

/// Renumbers a force. False when there is nothing left for it to do.
struct Kept {
  const Renumbering& renumbering;

  template <class JointForce>
  requires requires(JointForce f) { f.joint; }
  bool operator()(JointForce& f) const {
    f.joint = renumbering.joints[f.joint];
    return f.joint >= 0;
  }
  bool operator()(PointForce& f) const { return Moves(&f.body); }
  bool operator()(Drag& f) const { return Moves(&f.point.body); }
  bool operator()(SpringDamper& f) const {
    const bool from = Moves(&f.from.body), to = Moves(&f.to.body);
    const bool lost = f.from.body < 0 || f.to.body < 0;  // another part's
    return !lost && (from || to) && f.from.body != f.to.body;
  }
  /// What is not known has not been renumbered (KnowsForces, FindIslands).
  template <class Other>
  bool operator()(Other&) const {
    return true;
  }

 private:
  bool Moves(int* body) const {
    *body = renumbering.bodies[*body];
    return *body > kGround;
  }
};

/// A point of a body, seen from the carrier.
void MovePoint(const std::vector<Attachment>& attachments, int* body, Vector3* at) {
  const Attachment& attachment = attachments[*body];
  if (!attachment.attached) return;
  *body = attachment.carrier;
  *at = attachment.X.R * *at + attachment.X.p;
}

/// Names of independent speeds that still exist. A list with a gap is of no use: all or none.
std::vector<std::string> KeptNames(const MechanismDescription& old, const Renumbering& kept) {
  for (const std::string& name : old.independent) {
    const std::string owner = name.substr(0, name.rfind('.'));
    for (std::size_t i = 0; i < old.bodies.size(); ++i) {
      if (old.bodies[i].name == owner && kept.bodies[i] < 0) return {};
    }
    for (std::size_t j = 0; j < old.joints.size(); ++j) {
      if ((old.joints[j].name == name || old.joints[j].name == owner) && kept.joints[j] < 0) {
        return {};
      }
    }
  }
  return old.independent;
}

std::vector<JointValues> KeptValues(const std::vector<JointValues>& old, const Renumbering& kept) {
  std::vector<JointValues> values;
  for (const JointValues& one : old) {
    if (kept.joints[one.joint] >= 0) values.push_back({kept.joints[one.joint], one.values});
  }
  return values;
}

}  // namespace

bool KnowsForces(const MechanismDescription& description) {
  return std::ranges::all_of(description.forces, [](const ForceDescription& force) {
    return std::visit(IsKnown(), force);
  });
}

MechanismDescription Select(const MechanismDescription& description,
                            const Renumbering& renumbering) {
  // A new member of the description must be thought about here: this line stops compiling.
  const auto& [name, space, gravity, bodies, joints, forces, initial, independent] = description;
  MechanismDescription part;
  part.name = name;
  part.space = space;
  part.gravity = gravity;
  part.bodies.clear();
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    if (renumbering.bodies[i] >= 0) part.bodies.push_back(bodies[i]);
  }
  for (std::size_t j = 0; j < joints.size(); ++j) {
    if (renumbering.joints[j] < 0) continue;
    // And a new member of a joint: what it says must survive a change of the frames' bodies.
    const auto& [joint_name, type, from, to, axis, pitch, length, cut, released, motions] =
        joints[j];
    JointDescription joint{joint_name, type, from, to, axis, pitch, length, cut, released, motions};
    joint.from.body = renumbering.bodies[from.body];
    joint.to.body = renumbering.bodies[to.body];
    part.joints.push_back(joint);
  }
  const Kept kept{renumbering};
  for (ForceDescription force : forces) {
    if (std::visit(kept, force)) part.forces.push_back(force);
  }
  part.initial.coordinates = KeptValues(initial.coordinates, renumbering);
  part.initial.speeds = KeptValues(initial.speeds, renumbering);
  for (const int joint : initial.held) {
    if (renumbering.joints[joint] >= 0) part.initial.held.push_back(renumbering.joints[joint]);
  }
  part.independent = KeptNames(description, renumbering);
  return part;
}

MechanismDescription Attach(const MechanismDescription& description,
                            const std::vector<Attachment>& attachments, Renumbering* renumbering) {
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
    if (auto* point = std::get_if<PointForce>(&force); point != nullptr) {
      const Attachment& at = attachments[point->body];
      if (at.attached && point->in_body_axes) point->force = at.X.R * point->force;
      MovePoint(attachments, &point->body, &point->at);
    } else if (auto* drag = std::get_if<Drag>(&force); drag != nullptr) {
      MovePoint(attachments, &drag->point.body, &drag->point.at);
    } else if (auto* spring = std::get_if<SpringDamper>(&force); spring != nullptr) {
      MovePoint(attachments, &spring->from.body, &spring->from.at);
      MovePoint(attachments, &spring->to.body, &spring->to.at);
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
