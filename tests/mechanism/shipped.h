// Mechanisms of configs/mechanisms by name, and a door.
#pragma once

#include <string>

#include "harness/config/mechanism_reader.h"
#include "mechanism/description/library.h"

namespace loopbench::testing {

inline MechanismDescription Shipped(const std::string& name) {
  return harness::ReadMechanism(std::string(LOOPBENCH_SOURCE_DIR) + "/configs/mechanisms/" + name +
                                ".json")
      .description;
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
