// Shared by tests with peers: their registration, what Simbody lacks, a gripper, hostile names, and
// differences.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <random>
#include <span>
#include <string>
#include <vector>

#include "harness/base/record.h"
#include "harness/exchange/import.h"
#include "mechanism/description/library.h"
#include "peers/register.h"

namespace loopbench::harness::peers_test {

inline const bool kRegistered = (peers::RegisterPeers(), true);

/// Shipped mechanisms that Simbody cannot express here, with the message.
inline const std::map<std::string, std::string> kInexpressible = {
    {"driven-four-bar", "peer/simbody does not have: joint \"OA\": a prescribed motion"},
    {"screw-jack",
     "peer/simbody does not have: joint_torque along joint \"bearing\", which depends on time"}};

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

/// A ladder with names that would act in XML, in C++, in a format of printf or on a terminal if
/// they were more than names. Bodies and joints both take names from the start of the list.
inline MechanismDescription HostileLadder(const std::string& name,
                                          std::vector<std::string>* names) {
  *names = {"\"); std::system(\"touch harmed\"); (\"",
            "*/ #error harmed /*",
            "two\nlines // \\",
            "\n#error harmed",
            "\?\?/\n#error harmed",
            "\\\" \\n \\",
            "%s%n%d",
            "<a href='x'>&amp;\"--></a>",
            "world",
            "tab\tand \x01 and \x7f",
            "\u00fc \u202e reversed",
            ")\" ; ]]>"};
  MechanismDescription mechanism = Ladder(2, 1.0, 0.5);
  EXPECT_GE(names->size(), mechanism.bodies.size());
  mechanism.name = name;
  for (std::size_t i = 1; i < mechanism.bodies.size(); ++i) {
    mechanism.bodies[i].name = names->at(i - 1);
    mechanism.bodies[i].points[names->at(i)] = {0.25, 0.0, 0.0};
  }
  for (std::size_t i = 0; i < mechanism.joints.size(); ++i) {
    mechanism.joints[i].name = names->at(i);
  }
  return mechanism;
}

inline constexpr double kEps = std::numeric_limits<double>::epsilon();

inline double Largest(std::span<const double> values) {
  double largest = 0.0;
  for (const double value : values) largest = std::max(largest, std::abs(value));
  return largest;
}

inline double LargestDifference(std::span<const double> a, std::span<const double> b) {
  double largest = a.size() == b.size() ? 0.0 : INFINITY;
  for (std::size_t i = 0; i < std::min(a.size(), b.size()); ++i) {
    // written so that a NaN stays
    if (!(std::abs(a[i] - b[i]) <= largest)) largest = std::abs(a[i] - b[i]);
  }
  return largest;
}

/// How far `function` moves from its `value` at y when y does in its last bits: what round-off in a
/// state, and in sums of forces that nearly cancel, does to accelerations.
template <class Function>
double Sensitivity(std::span<const double> y, std::span<const double> value,
                   const Function& function) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> bits(-kEps, kEps);
  std::vector<double> near(y.size());
  double largest = 0.0;
  for (int draw = 0; draw < 16; ++draw) {
    for (std::size_t i = 0; i < y.size(); ++i) {
      near[i] = y[i] + bits(random) * std::max(1.0, std::abs(y[i]));
    }
    const std::vector<double> other = function(near);
    largest = std::max(largest, LargestDifference(value, other));
  }
  return largest;
}

/// The largest difference of final poses.
inline double EndDifference(const Record& ours, const Record& theirs) {
  double difference = 0.0;
  int poses = 0;
  for (const auto& [key, value] : ours.items()) {
    if (!key.starts_with("series.final.")) continue;
    const double pose = LargestDifference(ours.Numbers(key), theirs.Numbers(key));
    if (!(pose <= difference)) difference = pose;  // a NaN stays
    ++poses;
  }
  EXPECT_GT(poses, 0);
  return difference;
}

}  // namespace loopbench::harness::peers_test
