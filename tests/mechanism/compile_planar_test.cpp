// Spatial descriptions that are planar, in any orientation, and those that are not quite.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "mechanism/description/library.h"
#include "mechanism/description/transforms.h"
#include "tests/mechanism/compiled_motion.h"
#include "tests/mechanism/scramble.h"

namespace loopbench::testing {
namespace compile_planar_test {

TEST(CompilePlanarTest, TiltedPlanarMechanismsBecomePlanar) {
  std::vector<MechanismDescription> mechanisms;
  for (std::uint64_t seed = 1; seed <= 8; ++seed) {
    mechanisms.push_back(RandomChain(3 + static_cast<int>(seed), SpaceKind::kPlanar, seed));
    mechanisms.push_back(
        RandomLadder(1 + static_cast<int>(seed % 4), SpaceKind::kPlanar, 50 + seed));
    mechanisms.push_back(
        RandomGraph(1 + static_cast<int>(seed % 3), SpaceKind::kPlanar, 100 + seed));
    mechanisms.push_back(
        MixedGraph(1 + static_cast<int>(seed % 2), SpaceKind::kPlanar, 200 + seed));
  }
  // the ends of a rod may leave a plane, so it does not qualify
  std::erase_if(mechanisms, [](const MechanismDescription& mechanism) {
    return std::ranges::find(mechanism.joints, JointType::kRod, &JointDescription::type) !=
           mechanism.joints.end();
  });
  ASSERT_GE(mechanisms.size(), 24u);
  for (std::size_t i = 0; i < mechanisms.size(); ++i) {
    const MechanismDescription tilted = Scramble(mechanisms[i], 1000 + i);
    ASSERT_EQ(tilted.space, SpaceKind::kSpatial);
    const Truth truth = MakeTruth<Spatial>(tilted, i);
    Compiled compiled;
    ExpectSameMotion(truth, kOnlyPlanar, &compiled);
    ASSERT_TRUE(compiled.done.planar) << mechanisms[i].name << ": " << compiled.report.back();
    EXPECT_EQ(compiled.parts[0].description.space, SpaceKind::kPlanar);
    EXPECT_EQ(compiled.parts[0].description.joints.size(), tilted.joints.size());
  }
}

TEST(CompilePlanarTest, PlanarJointsBecomeFreeInThePlane) {
  MechanismDescription d = InSpace(Chain(3), {0.3, -0.4, 0.5});
  JointDescription sheet;  // a body that slides on the ground's plane, pinned to the second bar
  sheet.name = "sheet";
  sheet.type = JointType::kPlanar;
  d.bodies.push_back(Bar("plate", 1.0, 2.0, 0.5));
  sheet.from = d.joints[0].from;
  sheet.to.body = 4;
  d.joints.push_back(sheet);
  d.joints.push_back(Revolute("pin", 2, {0.5, 0.0, 0.0}, 4, {0.2, 0.1, 0.0}));
  const Mechanism<Spatial, double> mechanism(d, Coordinates::kJoint);
  ASSERT_EQ(Assemble<Spatial>(d, mechanism).outcome, Outcome::kFinished);
  const Compiled compiled = Compile(d);
  ASSERT_TRUE(compiled.done.planar) << compiled.report.back();
  EXPECT_EQ(compiled.parts[0].description.joints[4].type, JointType::kFree);
  const Mechanism<Planar, double> planar(compiled.parts[0].description, Coordinates::kJoint);
  EXPECT_EQ(Assemble<Planar>(compiled.parts[0].description, planar).outcome, Outcome::kFinished);
}

TEST(CompilePlanarTest, WhatTipsOutOfThePlaneStaysSpatial) {
  const MechanismDescription level = InSpace(Chain(4), {0.3, -0.4, 0.5});
  ASSERT_TRUE(Compile(level).done.planar);
  MechanismDescription tipped = level;
  tipped.joints[1].to.rotation.x() = 1e-6;
  EXPECT_FALSE(Compile(tipped).done.planar);
  MechanismDescription skew = level;
  skew.joints[4].from.position.z() += 1e-6;
  EXPECT_FALSE(Compile(skew).done.planar);
  MechanismDescription sliding = level;
  sliding.joints[1].type = JointType::kCylindrical;
  sliding.initial.coordinates[1].values.push_back(0.0);
  EXPECT_FALSE(Compile(sliding).done.planar);
  MechanismDescription loose = level;
  loose.bodies.push_back(Bar("loose", 1.0, 1.0, 1.0));
  EXPECT_FALSE(Compile(loose).done.planar);
}

TEST(CompilePlanarTest, ForcesAndGravityAlongTheNormalAreDroppedAndReported) {
  MechanismDescription d = InSpace(Chain(3), Eigen::Vector3d::Zero());
  d.gravity.z() = 3.0;
  d.forces.push_back(PointForce{1, {0.5, 0.0, 0.0}, {1.0, 2.0, 5.0}, false});
  const Truth truth = MakeTruth<Spatial>(d, 1);
  Compiled compiled;
  ExpectSameMotion(truth, kOnlyPlanar, &compiled);
  ASSERT_TRUE(compiled.done.planar);
  EXPECT_EQ(compiled.report.size(), 3u);
  EXPECT_EQ(compiled.parts[0].description.gravity.z(), 0.0);
}

}  // namespace compile_planar_test
}  // namespace loopbench::testing
