// Whether anything moves: first order, and at all. And that far centres of mass and other parts
// have no say in it.
#include "mechanism/description/transforms.h"
#include "mechanism/simplify/structure.h"
#include "tests/mechanism/shipped.h"

namespace loopbench::mobility_test {

using testing::Shipped;
using testing::TautChain;

/// A triangle of two bars and Ground.
MechanismDescription Triangle() {
  MechanismDescription d = TautChain(2);
  d.joints.back().to.position.x() -= 0.5;
  d.initial.coordinates = {{0, {0.7}}, {1, {-1.4}}};
  return d;
}

/// A pendulum of the last body.
MechanismDescription WithPendulum(MechanismDescription d, double size = 1.0) {
  const Eigen::Vector3d O = Eigen::Vector3d::Zero();
  d.bodies.push_back(Bar("pendulum", size, 1.0, size * size));
  d.joints.push_back(Revolute("P", 0, O, static_cast<int>(d.bodies.size()) - 1, O));
  return d;
}

TEST(Mobility, AStretchedChainHasSpeedsThatLeadNowhere) {
  for (const int bars : {2, 3, 6, 7, 12, 20}) {
    const Structure s = AnalyseStructure(TautChain(bars));
    EXPECT_EQ(s.freedom_at_start(), bars - 1) << "one of two constraints is lost in line";
    EXPECT_TRUE(s.locked()) << bars;
    EXPECT_EQ(s.freedom(), 0) << bars;
    EXPECT_EQ(s.start.outcome, Outcome::kLocked);
    EXPECT_NE(s.start.message.find("nowhere"), std::string::npos) << s.start.message;
  }
}

TEST(Mobility, APartThatCannotMoveIsNamedThoughOthersCan) {
  for (const double size : {0.01, 1.0, 100.0}) {  // of the pendulum beside it
    const Structure s = AnalyseStructure(WithPendulum(TautChain(3), size));
    EXPECT_EQ(s.start.outcome, Outcome::kLocked) << size;
    EXPECT_NE(s.start.message.find("the part of body \"b0\" cannot move"), std::string::npos)
        << s.start.message;
    EXPECT_FALSE(s.locked()) << "the pendulum swings";
    EXPECT_EQ(s.freedom(), 1) << size;
    EXPECT_TRUE(s.redundant.empty()) << size;
  }
}

TEST(Mobility, ASpringBetweenPartsDoesNotHideTheLockedOne) {
  MechanismDescription d = WithPendulum(TautChain(3));
  const Eigen::Vector3d tip = Eigen::Vector3d::UnitX();
  d.forces.push_back(SpringDamper{.from = {1, tip}, .to = {4, tip}, .stiffness = 1.0});
  const Structure s = AnalyseStructure(d);
  EXPECT_EQ(s.islands.size(), 1u) << "parts that act on each other";
  EXPECT_EQ(s.start.outcome, Outcome::kLocked);
  EXPECT_EQ(s.freedom(), 1);
}

TEST(Mobility, RigidPartsStayWhereTheyAreAndLockNothing) {
  const Structure s = AnalyseStructure(WithPendulum(Triangle()));
  EXPECT_EQ(s.start.outcome, Outcome::kFinished) << s.start.message;
  EXPECT_EQ(s.freedom(), 1);
}

TEST(Mobility, ALittleSlackAndItMoves) {
  for (const int bars : {3, 6}) {
    MechanismDescription d = TautChain(bars);
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
  const Structure s = AnalyseStructure(Triangle());
  EXPECT_EQ(s.start.outcome, Outcome::kLocked);
  EXPECT_TRUE(s.locked());
  EXPECT_EQ(s.freedom(), 0);
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
    const Structure s = AnalyseStructure(testing::Beside(one, AtScale(one, size)));
    EXPECT_EQ(s.rank, 4) << size;
    EXPECT_EQ(s.freedom(), 2) << size;
  }
}

}  // namespace loopbench::mobility_test
