// Descriptions without welds, immovable bodies and islands have the accelerations of the user's,
// which the long double oracle knows.
#include <gtest/gtest.h>

#include <cmath>

#include "mechanism/description/library.h"
#include "mechanism/description/transforms.h"
#include "tests/mechanism/compiled_motion.h"

namespace loopbench::testing {
namespace compile_test {

TEST(CompileTest, WeldedBodiesMoveAsOne) {
  int merged = 0;
  for (std::uint64_t seed = 1; seed <= 12; ++seed) {
    const int n = 6 + static_cast<int>(seed);
    const int loops = 1 + static_cast<int>(seed % 3);
    for (const SpaceKind space : {SpaceKind::kPlanar, SpaceKind::kSpatial}) {
      for (const MechanismDescription& d :
           {RandomTree(n, space, seed), RandomGraph(loops, space, 300 + seed),
            MixedGraph(loops, space, 400 + seed)}) {
        const Truth truth =
            space == SpaceKind::kPlanar ? MakeTruth<Planar>(d, seed) : MakeTruth<Spatial>(d, seed);
        Compiled compiled;
        ExpectSameMotion(truth, kOnlyWelds, &compiled);
        merged += compiled.done.welds;
        const MechanismDescription& left = compiled.parts[0].description;
        for (const TreeEdge& edge : BuildTopology(left, Coordinates::kJoint).edges) {
          if (edge.joint < 0) continue;
          EXPECT_NE(left.joints[edge.joint].type, JointType::kWeld) << d.name;
        }
      }
    }
  }
  EXPECT_GT(merged, 30) << "of 72 samples: otherwise nothing was tested";
}

/// Two bars that stand on the ground as an arch of height `h`, a pendulum on top.
MechanismDescription Arch(double h) {
  const Eigen::Vector3d O = Eigen::Vector3d::Zero(),
                        tip = std::hypot(0.5, h) * Eigen::Vector3d::UnitX();
  MechanismDescription d;
  d.name = "arch";
  d.gravity = {0.0, -9.81, 0.0};
  for (const char* name : {"left", "right"}) d.bodies.push_back(Bar(name, tip.x(), 1.0, 1.0));
  d.bodies.push_back(Bar("pendulum", 1.0, 1.0, 1.0));
  d.bodies.push_back(Bar("second", 1.0, 1.0, 1.0));
  d.joints = {Revolute("A", 0, O, 1, O), Revolute("B", 0, Eigen::Vector3d::UnitX(), 2, O),
              Revolute("C", 1, tip, 2, tip), Revolute("D", 2, 0.5 * tip, 3, O),
              Revolute("E", 3, Eigen::Vector3d::UnitX(), 4, O)};
  const double angle = std::atan2(h, 0.5);
  d.initial.coordinates = {{0, {angle}}, {1, {std::acos(-1.0) - angle}}, {3, {2.0}}, {4, {1.0}}};
  d.initial.speeds = {{3, {0.7}}};
  return d;
}

TEST(CompileTest, RigidArchBecomesGround) {
  const MechanismDescription arch = Arch(0.7);
  const Truth truth = MakeTruth<Planar>(arch, 3);
  Compiled compiled;
  ExpectSameMotion(truth, {.planar = false, .welds = false, .immovable = true}, &compiled);
  EXPECT_TRUE(compiled.done.immovable);
  ASSERT_EQ(compiled.parts[0].description.bodies.size(), 3u);
  EXPECT_EQ(compiled.parts[0].description.joints.size(), 2u);
  EXPECT_EQ(compiled.bodies[1].part, -1);
  EXPECT_EQ(compiled.bodies[2].part, -1);
  EXPECT_EQ(compiled.bodies[3].body, 1);
  EXPECT_EQ(compiled.joints[3].joint, 0);
}

TEST(CompileTest, FlatArchIsNotCertain) {
  // in line: the middle joint can move to first order
  EXPECT_FALSE(Compile(Arch(0.0)).done.immovable);
  EXPECT_FALSE(Compile(Arch(1e-5)).done.immovable);
}

TEST(CompileTest, SliderAtDeadCentreIsNotFixed) {
  // it stands still to first order, but only until the crank has turned
  const Eigen::Vector3d O = Eigen::Vector3d::Zero(), X = Eigen::Vector3d::UnitX();
  MechanismDescription d;
  d.name = "slider-crank";
  for (const char* name : {"crank", "rod", "slider"}) d.bodies.push_back(Bar(name, 1.0, 1.0, 1.0));
  d.bodies[2].com = 1.5 * X;
  JointDescription slide;
  slide.name = "S";
  slide.type = JointType::kPrismatic;
  slide.to.body = 3;
  d.joints = {Revolute("O", 0, O, 1, O), Revolute("P", 1, X, 2, O), Revolute("Q", 2, 2.0 * X, 3, O),
              slide};
  d.joints[3].cut = true;
  d.initial.coordinates = {{0, {0.0}}, {1, {0.0}}, {2, {0.0}}};
  const Mechanism<Planar, double> mechanism(d, Coordinates::kJoint);
  ASSERT_EQ(Assemble(d, mechanism).outcome, Outcome::kFinished);
  const Compiled compiled = Compile(d, CompileOptions::All());
  EXPECT_FALSE(compiled.done.immovable);
  EXPECT_EQ(compiled.parts[0].description.bodies.size(), 4u);
}

TEST(CompileTest, RigidBodiesStayWhereALoopWouldHaveToBeCutAnew) {
  // the way to the second bar of the arch leads over the pendulum, by joints with initial values
  MechanismDescription d = Arch(0.7);
  d.bodies.push_back(Bar("third", 1.0, 1.0, 1.0));
  d.joints.push_back(Revolute("G", 4, Eigen::Vector3d::UnitX(), 5, Eigen::Vector3d::Zero()));
  d.initial.coordinates.push_back({5, {0.5}});
  JointDescription back = Revolute("F", 5, Eigen::Vector3d::UnitX(), 1, Eigen::Vector3d::Zero());
  const Mechanism<Planar, double> mechanism(d, Coordinates::kJoint);
  const Start<double> start = Assemble(d, mechanism);
  ASSERT_EQ(start.outcome, Outcome::kFinished);
  Kinematics<Planar, double> kinematics(mechanism);
  kinematics.UpdatePosition(start.q);
  const Pose<Planar, double>&left = kinematics.poses()[1], &last = kinematics.poses()[5];
  const Linear<Planar, double> tip = last.p + last.R * Linear<Planar, double>(0.5, 0.0);
  back.to.position.head<2>() = (left.R.transpose() * (tip - left.p)).eigen();
  back.to.position += d.bodies[1].com;
  d.joints.push_back(back);
  d.initial.coordinates = {
      {0, {start.q[0]}}, {3, {2.0}}, {4, {1.0}}, {5, {0.5}}, {6, {last.angle}}};
  d.initial.coordinates.back().values[0] = left.angle - last.angle;
  d.initial.speeds.clear();
  d.joints[1].cut = d.joints[2].cut = true;
  const Mechanism<Planar, double> looped(d, Coordinates::kJoint);
  const Start<double> looped_start = Assemble(d, looped);
  ASSERT_EQ(looped_start.outcome, Outcome::kFinished) << looped_start.message;
  const Compiled compiled = Compile(d);
  const MechanismDescription& left_over = compiled.parts[0].description;
  const Mechanism<Planar, double> again(left_over, Coordinates::kJoint);
  const Start<double> again_start = Assemble(left_over, again);
  EXPECT_EQ(again_start.outcome, Outcome::kFinished) << again_start.message;
}

TEST(CompileTest, LockedMechanismsStayAsTheyAre) {
  MechanismDescription locked = Arch(0.7);
  locked.bodies.resize(3);
  locked.joints.resize(3);
  locked.initial.coordinates.resize(2);
  locked.initial.speeds.clear();
  const Compiled compiled = Compile(locked, CompileOptions::All());
  EXPECT_FALSE(compiled.done.immovable);
  EXPECT_EQ(compiled.parts[0].description.bodies.size(), 3u);
}

/// Both, side by side; the second one's names with a prime.
MechanismDescription Beside(MechanismDescription a, const MechanismDescription& b) {
  const int bodies = static_cast<int>(a.bodies.size()) - 1,
            joints = static_cast<int>(a.joints.size());
  a.gravity = b.gravity;
  for (std::size_t i = 1; i < b.bodies.size(); ++i) {
    a.bodies.push_back(b.bodies[i]);
    a.bodies.back().name += "'";
  }
  for (JointDescription joint : b.joints) {
    joint.name += "'";
    for (JointSide* side : {&joint.from, &joint.to}) {
      if (side->body != kGround) side->body += bodies;
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
  return a;
}

TEST(CompileTest, IslandsMoveAloneAsTheyMoveTogether) {
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    const MechanismDescription both =
        Beside(RandomGraph(2, SpaceKind::kPlanar, seed), RandomLadder(2, SpaceKind::kPlanar, seed));
    const Truth truth = MakeTruth<Planar>(both, seed);
    Compiled compiled;
    ExpectSameMotion(truth, {.planar = false, .welds = false, .immovable = false, .islands = true},
                     &compiled);
    EXPECT_TRUE(compiled.done.islands);
    EXPECT_GE(compiled.parts.size(), 2u);  // branches of a graph from ground are parts, too
    std::size_t bodies = 0, joints = 0, forces = 0;
    for (const CompiledPart& part : compiled.parts) {
      bodies += part.description.bodies.size() - 1;
      joints += part.description.joints.size();
      forces += part.description.forces.size();
    }
    EXPECT_EQ(bodies, both.bodies.size() - 1);
    EXPECT_EQ(joints, both.joints.size());
    EXPECT_EQ(forces, both.forces.size());
  }
}

TEST(CompileTest, PartsInDifferentPlanesAreEachPlanar) {
  const MechanismDescription a = InSpace(Chain(3), {0.3, -0.4, 0.5});
  const MechanismDescription b = InSpace(Chain(4), {-1.0, 0.2, 0.1});
  const MechanismDescription both = Beside(a, b);
  EXPECT_FALSE(Compile(both, kOnlyPlanar).done.planar);
  const Truth truth = MakeTruth<Spatial>(both, 5);
  Compiled compiled;
  ExpectSameMotion(truth, CompileOptions::All(), &compiled);
  ASSERT_EQ(compiled.parts.size(), 2u);
  for (const CompiledPart& part : compiled.parts) {
    EXPECT_EQ(part.description.space, SpaceKind::kPlanar);
  }
}

TEST(CompileTest, NothingIsDoneWhenAllIsOffOrNothingIsToSave) {
  const MechanismDescription tilted = InSpace(Chain(3), {0.3, -0.4, 0.5});
  EXPECT_EQ(Compile(tilted, CompileOptions::None()).done, CompileOptions::None());
  const Compiled same = Compile(Chain(5), CompileOptions::All());
  EXPECT_EQ(same.done, CompileOptions::None());
  EXPECT_TRUE(same.report.empty());
  EXPECT_EQ(same.parts[0].description.joints.size(), 6u);
}

}  // namespace compile_test
}  // namespace loopbench::testing
