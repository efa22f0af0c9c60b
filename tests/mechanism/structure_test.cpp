// Facts of mechanisms whose structure is known on paper.
#include "mechanism/simplify/structure.h"

#include "tests/mechanism/shipped.h"

namespace loopbench::structure_test {

using testing::Shipped;

TEST(StructureTest, FourBarHasOneLoopThroughAllItsJoints) {
  const Structure s = AnalyseStructure(Shipped("four-bar"));
  EXPECT_EQ(s.bodies, 3);
  EXPECT_EQ(s.joints, 4);
  EXPECT_EQ(s.rows, 8);
  EXPECT_EQ(s.counted_freedom, 1);
  EXPECT_EQ(s.freedom(), 1);
  EXPECT_EQ(s.freedom_at_start(), 1);
  EXPECT_EQ(s.rank, 2);
  EXPECT_TRUE(s.redundant.empty());
  EXPECT_FALSE(s.locked());
  EXPECT_FALSE(s.singular_start());
  ASSERT_EQ(s.loops.size(), 1u);
  EXPECT_EQ(s.loops[0].cut_joint, 3);
  EXPECT_EQ(s.loops[0].joints, (std::vector<int>{3, 0, 1, 2}));  // OC, then from ground again
  EXPECT_EQ(s.loops[0].bodies, (std::vector<int>{0, 1, 2, 3}));
  EXPECT_LT(s.loops[0].open_shift, 1e-13);
  ASSERT_EQ(s.islands.size(), 1u);
  EXPECT_TRUE(s.islands[0].grounded);
  EXPECT_EQ(s.joint_u, 3);
  EXPECT_EQ(s.absolute_u, 9);
}

TEST(StructureTest, PlanarLoopInSpaceHasThreeNamedRedundantDirections) {
  MechanismDescription mechanism = Shipped("four-bar");
  mechanism.space = SpaceKind::kSpatial;
  const Structure s = AnalyseStructure(mechanism);
  EXPECT_EQ(s.counted_freedom, -2) << "6 * 3 - 5 * 4";
  EXPECT_EQ(s.freedom(), 1);
  EXPECT_EQ(s.rank, 2);
  // of a pin normal to the plane: what would tip the bars or push them out of the plane
  ASSERT_EQ(s.redundant.size(), 3u);
  std::vector<std::string> named;
  for (const RedundantDirection& one : s.redundant) {
    EXPECT_EQ(one.joint, 3);
    EXPECT_TRUE(one.released);
    named.push_back(one.name);
  }
  EXPECT_EQ(named, (std::vector<std::string>{"the moment about x of its frame on bar3",
                                             "the moment about y of its frame on bar3",
                                             "the force along z of its frame on bar3"}));
}

TEST(StructureTest, SevenBarHasTwoLoopsAndTwoFreedoms) {
  const Structure s = AnalyseStructure(Shipped("seven-bar"));
  EXPECT_EQ(s.counted_freedom, 2) << "3 * 6 - 2 * 8";
  EXPECT_EQ(s.freedom(), 2);
  EXPECT_EQ(s.rank, 4);
  EXPECT_TRUE(s.redundant.empty());
  ASSERT_EQ(s.loops.size(), 2u);
  EXPECT_EQ(s.loops[0].joints, (std::vector<int>{6, 0, 1, 2}));     // OC, OA, AB, BC
  EXPECT_EQ(s.loops[1].joints, (std::vector<int>{7, 1, 3, 4, 5}));  // FB, AB, AD, DE, EF
  EXPECT_EQ(s.loops[1].bodies, (std::vector<int>{2, 1, 4, 5, 6})) << "not through ground";
}

TEST(StructureTest, FlatParallelogramIsSingularNotRedundant) {
  const Structure s = AnalyseStructure(Shipped("parallelogram-singular-start"));
  EXPECT_EQ(s.rank, 1);
  EXPECT_EQ(s.rank_nearby, 2);
  EXPECT_TRUE(s.singular_start());
  EXPECT_EQ(s.freedom_at_start(), 2);
  EXPECT_EQ(s.freedom(), 1);
  EXPECT_TRUE(s.redundant.empty()) << "the loop is closed by both directions elsewhere";
}

TEST(StructureTest, ThirdCrankIsRedundantEverywhere) {
  const Structure s = AnalyseStructure(Shipped("three-cranks"));
  EXPECT_EQ(s.counted_freedom, 0);
  EXPECT_EQ(s.rank, 3);
  EXPECT_EQ(s.rank_nearby, 3);
  EXPECT_FALSE(s.singular_start());
  EXPECT_EQ(s.freedom(), 1);
  EXPECT_EQ(s.redundant.size(), 1u);
}

/// A force along a joint keeps it in the tree, where without it the loop would be cut there.
TEST(StructureTest, AForceAlongAJointChangesTheCutAndNoFreedom) {
  MechanismDescription without = Shipped("spatial-four-bar");
  std::swap(without.joints[1], without.joints[3]);  // a revolute joint is the last
  for (JointDescription& joint : without.joints) joint.cut = false;
  std::erase_if(without.initial.coordinates, [](const JointValues& one) { return one.joint > 0; });
  MechanismDescription with = without;
  with.forces = {JointDamper{3, 1.0}};
  const Structure plain = AnalyseStructure(without), damped = AnalyseStructure(with);
  EXPECT_EQ(plain.start.outcome, Outcome::kFinished);
  EXPECT_NE(plain.loop_rows, damped.loop_rows);
  for (const Structure& structure : {plain, damped}) {
    EXPECT_EQ(structure.rank, structure.loop_rows);
    EXPECT_EQ(structure.rank_nearby, structure.loop_rows);
    EXPECT_EQ(structure.freedom(), 1);
  }
}

TEST(StructureTest, LoopsThroughGroundOnlyAreSeparateParts) {
  MechanismDescription two = testing::Beside(Shipped("four-bar"), Shipped("four-bar"));
  two.bodies.push_back(Bar("loose", 1.0, 1.0, 1.0));
  const Structure s = AnalyseStructure(two);
  ASSERT_EQ(s.islands.size(), 3u);
  EXPECT_EQ(s.islands[0].bodies, (std::vector<int>{1, 2, 3}));
  EXPECT_EQ(s.islands[1].bodies, (std::vector<int>{4, 5, 6}));
  EXPECT_TRUE(s.islands[1].grounded);
  EXPECT_EQ(s.islands[2].bodies, (std::vector<int>{7}));
  EXPECT_FALSE(s.islands[2].grounded);
  EXPECT_EQ(s.freedom(), 1 + 1 + 3);
  ASSERT_EQ(s.loops.size(), 2u);
  EXPECT_EQ(s.loops[1].bodies, (std::vector<int>{0, 4, 5, 6}));
}

TEST(StructureTest, LoopThatCannotCloseIsMeasured) {
  MechanismDescription mechanism = Shipped("four-bar");
  mechanism.joints[3].to.position.x() = 5.0;  // the first bar is held, the others reach 2 m
  const Structure s = AnalyseStructure(mechanism);
  EXPECT_EQ(s.start.outcome, Outcome::kInconsistentStart);
  ASSERT_EQ(s.loops.size(), 1u);
  // a minimum of the squared gap: known to the square root of round-off
  EXPECT_NEAR(s.loops[0].open_shift, std::hypot(5.0 - std::cos(1.0), std::sin(1.0)) - 2.0, 1e-6);
  EXPECT_EQ(s.bodies, 3);
}

TEST(StructureTest, NearlyFlatTriangleIsBadlyConditioned) {
  // an arch of two bars whose joint stands h above the line through the supports
  for (const double h : {1e-1, 1e-3}) {
    const Eigen::Vector3d O = Eigen::Vector3d::Zero();
    const double length = std::hypot(1.0, h);
    MechanismDescription d;
    d.name = "arch";
    d.bodies.push_back(Bar("left", length, 1.0, 1.0));
    d.bodies.push_back(Bar("right", length, 1.0, 1.0));
    const Eigen::Vector3d tip = length * Eigen::Vector3d::UnitX();
    d.joints = {Revolute("A", 0, O, 1, O), Revolute("B", 0, {2.0, 0.0, 0.0}, 2, O),
                Revolute("C", 1, tip, 2, tip)};
    d.initial.coordinates = {{0, {std::atan2(h, 1.0)}}, {1, {kPi - std::atan2(h, 1.0)}}};
    const Structure s = AnalyseStructure(d);
    // the second direction is lost like the height
    EXPECT_LT(s.conditioning(), 3.0 * h);
    EXPECT_GT(s.conditioning(), 0.1 * h);
    EXPECT_EQ(s.rank, 2);
  }
}

}  // namespace loopbench::structure_test
