// A gripper with a coupling of two joints.
#pragma once

#include <gtest/gtest.h>

#include "harness/exchange/import.h"

namespace loopbench::harness::peers_test {

/// A palm on a turning wrist with two fingers, of which the second follows the first.
inline constexpr const char* kGripper = R"(<robot name="gripper"><link name="world"/>
<link name="palm"><inertial><mass value="1"/>
  <inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial></link>
<link name="left"><inertial><origin xyz="0.05 0 0"/><mass value="0.2"/>
  <inertia ixx="0.0001" iyy="0.0002" izz="0.0002" ixy="0" ixz="0" iyz="0"/></inertial></link>
<link name="right"><inertial><origin xyz="0.05 0 0"/><mass value="0.2"/>
  <inertia ixx="0.0001" iyy="0.0002" izz="0.0002" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="wrist" type="continuous"><parent link="world"/><child link="palm"/>
  <axis xyz="0 1 0"/></joint>
<joint name="l" type="continuous"><origin xyz="0 0.02 0"/><parent link="palm"/><child link="left"/>
  <axis xyz="0 0 1"/></joint>
<joint name="r" type="continuous"><origin xyz="0 -0.02 0"/><parent link="palm"/>
  <child link="right"/><axis xyz="0 0 1"/><mimic joint="l" multiplier="-0.8" offset="0.1"/></joint>
</robot>)";

/// The gripper in motion; joints 0 to 2 are `wrist`, `l` and `r`.
inline MechanismDescription Gripper() {
  MechanismDescription gripper = ImportText(kGripper, "gripper.urdf").description;
  EXPECT_EQ(gripper.joints.size(), 3u);
  EXPECT_EQ(gripper.couplings.size(), 1u);
  gripper.initial.speeds = {{0, {1.0}}, {1, {2.0}}};
  return gripper;
}

/// A gripper with a screw and a slide in place of two pins, a coupling of three joints, and rotors.
inline MechanismDescription GripperWithRotors() {
  MechanismDescription gripper = Gripper();
  gripper.joints[0].type = JointType::kHelical;
  gripper.joints[0].parameter = 0.02;
  gripper.joints[1].type = JointType::kPrismatic;
  gripper.couplings[0].parts.push_back({0, 0.3});
  for (JointDescription& joint : gripper.joints) joint.rotor_inertia = 1e-3;
  return gripper;
}

}  // namespace loopbench::harness::peers_test
