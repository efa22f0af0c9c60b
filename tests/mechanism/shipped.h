// Mechanisms of configs/mechanisms by name, parts of others, and starts.
#pragma once

#include "mechanism/description/library.h"
#include "mechanism/model/kinematics.h"
#include "mechanism/start/assembly.h"
#include "tests/harness/places.h"

namespace loopbench::testing {

inline MechanismDescription Shipped(const std::string& name) {
  return harness::Shipped(name).description;
}

/// A mechanism and its kinematics at the start that Assemble() returns.
template <class Space = Planar>
struct Assembled {
  explicit Assembled(const MechanismDescription& d, Coordinates set = Coordinates::kJoint)
      : mechanism(d, set), start(Assemble<Space>(d, mechanism)), kinematics(mechanism) {
    kinematics.UpdatePosition(start.q);
    kinematics.UpdateVelocity(start.u);
  }

  Mechanism<Space, double> mechanism;
  Start<double> start;
  Kinematics<Space, double> kinematics;
};

/// Both, side by side; the second one's names end in `ending`.
inline MechanismDescription Beside(MechanismDescription a, const MechanismDescription& b,
                                   const std::string& ending = "'") {
  const int bodies = static_cast<int>(a.bodies.size()) - 1,
            joints = static_cast<int>(a.joints.size());
  for (std::size_t i = 1; i < b.bodies.size(); ++i) {
    a.bodies.push_back(b.bodies[i]);
    a.bodies.back().name += ending;
  }
  for (JointDescription joint : b.joints) {
    joint.name += ending;
    for (JointSide* side : {&joint.from, &joint.to}) {
      side->body += side->body == kGround ? 0 : bodies;
    }
    a.joints.push_back(joint);
  }
  for (ForceDescription force : b.forces) {
    const ForceParts parts = PartsOf(force);
    if (parts.joint != nullptr) *parts.joint += joints;
    for (BodyPoint* point : parts.points) point->body += point->body == kGround ? 0 : bodies;
    a.forces.push_back(force);
  }
  for (JointValues values : b.initial.coordinates) {
    values.joint += joints;
    a.initial.coordinates.push_back(values);
  }
  for (const int held : b.initial.held) a.initial.held.push_back(held + joints);
  return a;
}

/// Unit bars in line between ground pins as far apart as they are long together.
inline MechanismDescription TautChain(int bars, SpaceKind space = SpaceKind::kPlanar) {
  MechanismDescription d;
  d.name = "taut";
  d.space = space;
  const Eigen::Vector3d O = Eigen::Vector3d::Zero(), tip = Eigen::Vector3d::UnitX();
  for (int i = 0; i < bars; ++i) {
    d.bodies.push_back(Bar("b" + std::to_string(i), 1.0, 1.0, 1.0));
    d.joints.push_back(Revolute("J" + std::to_string(i), i, i == 0 ? O : tip, i + 1, O));
  }
  d.joints.push_back(Revolute("end", bars, tip, 0, bars * tip));
  d.joints.back().cut = true;
  return d;
}

/// A body on two joints of a kind on one axis.
inline MechanismDescription Door(JointType type = JointType::kRevolute) {
  MechanismDescription d;
  d.name = "door";
  d.space = SpaceKind::kSpatial;
  d.bodies.push_back(Bar("door", 1.0, 1.0, 1.0));
  for (const double z : {0.0, 2.0}) {
    const Eigen::Vector3d at(0.0, 0.0, z);
    d.joints.push_back(Revolute("hinge" + std::to_string(static_cast<int>(z)), 0, at, 1, at));
    d.joints.back().type = type;
    if (type == JointType::kHelical) d.joints.back().parameter = 0.3;
  }
  return d;
}

}  // namespace loopbench::testing
