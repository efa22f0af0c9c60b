// Whether anything moves: first order, and at all. And that far centres of mass and other parts
// have no say in it.
#include "mechanism/start/mobility.h"

#include <gtest/gtest.h>

#include <numbers>

#include "mechanism/description/library.h"
#include "mechanism/simplify/structure.h"
#include "tests/mechanism/shipped.h"

namespace loopbench {
namespace mobility_test {

using testing::Shipped;

/// Unit bars in line between ground pins as far apart as they are long together.
MechanismDescription Stretched(int bars) {
  MechanismDescription d;
  d.name = "stretched";
  const Eigen::Vector3d O = Eigen::Vector3d::Zero(), tip = Eigen::Vector3d::UnitX();
  for (int i = 0; i < bars; ++i) d.bodies.push_back(Bar("b" + std::to_string(i), 1.0, 1.0, 1.0));
  for (int i = 0; i < bars; ++i) {
    d.joints.push_back(Revolute("J" + std::to_string(i), i, i == 0 ? O : tip, i + 1, O));
  }
  d.joints.push_back(Revolute("end", bars, tip, 0, bars * tip));
  d.joints.back().cut = true;
  return d;
}

TEST(Mobility, AStretchedChainHasSpeedsThatLeadNowhere) {
  for (const int bars : {2, 3, 6, 7, 12, 20}) {
    const Structure s = AnalyseStructure(Stretched(bars));
    EXPECT_EQ(s.freedom_at_start(), bars - 1) << "one of two constraints is lost in line";
    EXPECT_TRUE(s.locked()) << bars;
    EXPECT_EQ(s.freedom(), 0) << bars;
    EXPECT_EQ(s.start.outcome, Outcome::kLocked);
    EXPECT_NE(s.start.message.find("nowhere"), std::string::npos) << s.start.message;
  }
}

TEST(Mobility, APartThatCannotMoveIsNamedThoughOthersCan) {
  for (const double size : {0.01, 1.0, 100.0}) {  // of the pendulum beside it
    MechanismDescription d = Stretched(3);
    d.bodies.push_back(Bar("pendulum", size, 1.0, size * size));
    const Eigen::Vector3d O = Eigen::Vector3d::Zero();
    d.joints.push_back(Revolute("P", 0, O, 4, O));
    const Structure s = AnalyseStructure(d);
    EXPECT_EQ(s.start.outcome, Outcome::kLocked) << size;
    EXPECT_NE(s.start.message.find("the part of body \"b0\" cannot move"), std::string::npos)
        << s.start.message;
    EXPECT_FALSE(s.locked()) << "the pendulum swings";
    EXPECT_EQ(s.freedom(), 1) << size;
    EXPECT_TRUE(s.redundant.empty()) << size;
  }
}

TEST(Mobility, ASpringBetweenPartsDoesNotHideTheLockedOne) {
  MechanismDescription d = Stretched(3);
  d.bodies.push_back(Bar("pendulum", 1.0, 1.0, 1.0));
  const Eigen::Vector3d O = Eigen::Vector3d::Zero(), tip = Eigen::Vector3d::UnitX();
  d.joints.push_back(Revolute("P", 0, O, 4, O));
  d.forces.push_back(SpringDamper{.from = {1, tip}, .to = {4, tip}, .stiffness = 1.0});
  const Structure s = AnalyseStructure(d);
  EXPECT_EQ(s.islands.size(), 1u) << "parts that act on each other";
  EXPECT_EQ(s.start.outcome, Outcome::kLocked);
  EXPECT_EQ(s.freedom(), 1);
}

TEST(Mobility, RigidPartsStayWhereTheyAreAndLockNothing) {
  MechanismDescription d = Stretched(2);
  d.joints.back().to.position.x() -= 0.5;  // a triangle
  d.initial.coordinates = {{0, {0.7}}, {1, {-1.4}}};
  d.bodies.push_back(Bar("pendulum", 1.0, 1.0, 1.0));
  const Eigen::Vector3d O = Eigen::Vector3d::Zero();
  d.joints.push_back(Revolute("P", 0, O, 3, O));
  const Structure s = AnalyseStructure(d);
  EXPECT_EQ(s.start.outcome, Outcome::kFinished) << s.start.message;
  EXPECT_EQ(s.freedom(), 1);
}

TEST(Mobility, ALittleSlackAndItMoves) {
  for (const int bars : {3, 6}) {
    MechanismDescription d = Stretched(bars);
    d.joints.back().to.position.x() -= 1e-3;
    d.initial.coordinates = {{0, {0.05}}, {1, {-0.08}}};
    const Structure s = AnalyseStructure(d);
    EXPECT_FALSE(s.locked()) << bars << s.start.message;
    EXPECT_EQ(s.freedom(), bars - 2);
  }
}

TEST(Mobility, SingularStartsWithBranchesMove) {
  for (const char* name :
       {"parallelogram-singular-start", "toggle-singular-start", "flat-seven-bar"}) {
    EXPECT_FALSE(AnalyseStructure(Shipped(name)).locked()) << name;
  }
  for (const int windows : {1, 2, 10, 40}) {  // flat
    const Structure s = AnalyseStructure(Ladder(windows, 0.0, 0.0));
    EXPECT_EQ(s.rank, windows);
    EXPECT_FALSE(s.locked()) << windows;
    EXPECT_EQ(s.rank_nearby, 2 * windows);
  }
}

TEST(Mobility, ATriangleIsLockedToFirstOrder) {
  MechanismDescription d = Stretched(2);
  d.joints.back().to.position.x() -= 0.5;
  d.initial.coordinates = {{0, {0.7}}, {1, {-1.4}}};
  const Structure s = AnalyseStructure(d);
  EXPECT_TRUE(s.locked());
  EXPECT_EQ(s.freedom_at_start(), 0);
}

TEST(RankOfGeometry, DoesNotKnowWhereCentresOfMassAre) {
  for (const double far : {1e2, 1e4, 1e6}) {
    for (const char* name : {"four-bar", "seven-bar", "bennett", "spatial-four-bar"}) {
      MechanismDescription d = Shipped(name);
      const Structure near = AnalyseStructure(d);
      d.bodies[1].com.x() = far;
      const Structure s = AnalyseStructure(d);
      EXPECT_EQ(s.rank, near.rank) << name << " " << far;
      EXPECT_EQ(s.freedom(), near.freedom()) << name << " " << far;
      // poses go through the centre of mass and keep far * eps of it
      EXPECT_NEAR(s.conditioning(), near.conditioning(), 1e-14 * far + 1e-9) << name << " " << far;
    }
  }
}

TEST(RankOfGeometry, KnowsEachPartByItself) {
  const MechanismDescription one = Shipped("four-bar");
  for (const double size : {1e-6, 1e-3, 1e3, 1e6}) {
    MechanismDescription two = one;
    for (std::size_t i = 1; i < one.bodies.size(); ++i) {
      BodyDescription body = one.bodies[i];
      body.name += "b";
      body.com *= size;
      body.inertia *= size * size;
      two.bodies.push_back(body);
    }
    for (JointDescription joint : one.joints) {
      const int offset = static_cast<int>(one.bodies.size()) - 1;
      for (JointSide* side : {&joint.from, &joint.to}) {
        if (side->body != kGround) side->body += offset;
        side->position *= size;
      }
      joint.name += "b";
      two.joints.push_back(joint);
    }
    for (const JointValues& values : one.initial.coordinates) {
      two.initial.coordinates.push_back(
          {values.joint + static_cast<int>(one.joints.size()), values.values});
    }
    const Structure s = AnalyseStructure(two);
    EXPECT_EQ(s.rank, 4) << size;
    EXPECT_EQ(s.freedom(), 2) << size;
  }
}

}  // namespace mobility_test
}  // namespace loopbench
