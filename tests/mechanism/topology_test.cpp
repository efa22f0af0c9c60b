// From the user's graph to a spanning forest: which joints are cut, in which order bodies come.
#include "mechanism/description/topology.h"

#include "mechanism/description/library.h"
#include "mechanism/model/mechanism.h"
#include "tests/contract/generators.h"
#include "tests/standard.h"

namespace loopbench::topology_test {

/// Four-bar whose joints are listed OA, AB, BC, OC and carry no values.
MechanismDescription FourBar() {
  MechanismDescription d = Chain(3);
  d.initial = {};
  return d;
}

std::vector<int> CutJoints(const MechanismDescription& d) {
  return BuildTopology(d, Coordinates::kJoint).constraints;
}

TEST(TopologyTest, CutJointsFollowMarksForcesAndInitialValues) {
  MechanismDescription d = FourBar();
  EXPECT_EQ(CutJoints(d), std::vector<int>{3}) << "among equals the joint listed last";
  d.joints[1].cut = true;
  EXPECT_EQ(CutJoints(d), std::vector<int>{1}) << "a joint marked cut";
  d = FourBar();
  d.forces.push_back(JointTorque{3, Polynomial{{1.0}}});
  d.initial.coordinates = {{2, {0.1}}};
  EXPECT_EQ(CutJoints(d), std::vector<int>{1}) << "neither with a force nor with an initial value";
}

TEST(TopologyTest, HeldJointsAreKeptRatherThanGuessedOnesAndTheseRatherThanForces) {
  MechanismDescription d = FourBar();
  d.initial.coordinates = {{0, {0.1}}, {1, {0.1}}, {2, {0.1}}, {3, {0.1}}};
  d.initial.held = {3};
  EXPECT_EQ(CutJoints(d), std::vector<int>{2});
  d.forces.push_back(JointTorque{1, Polynomial{{1.0}}});
  d.initial.coordinates = {{0, {0.1}}, {2, {0.1}}, {3, {0.1}}};
  EXPECT_EQ(CutJoints(d), std::vector<int>{1});
}

TEST(TopologyTest, ACutMarkInATreeHasNoLoopToOpen) {
  MechanismDescription d = FourBar();
  d.joints.pop_back();
  d.joints[0].cut = true;
  EXPECT_TRUE(CutJoints(d).empty());
}

TEST(TopologyTest, AbsoluteCoordinatesMakeEveryJointAConstraint) {
  const Topology topology = BuildTopology(FourBar(), Coordinates::kAbsolute);
  EXPECT_EQ(topology.constraints, (std::vector<int>{0, 1, 2, 3}));
  for (const TreeEdge& edge : topology.edges) {
    EXPECT_EQ(edge.joint, -1);
    EXPECT_EQ(edge.parent, kGround);
  }
}

TEST(TopologyTest, EveryBodyIsReachedOnceParentsFirst) {
  for (SpaceKind space : {SpaceKind::kPlanar, SpaceKind::kSpatial}) {
    for (std::uint64_t seed = 1; seed <= 5; ++seed) {
      const MechanismDescription d = testing::RedundantGraph(20, 4, space, seed);
      const Topology topology = BuildTopology(d, Coordinates::kJoint);
      std::vector<bool> reached(d.bodies.size(), false);
      reached[kGround] = true;
      for (const TreeEdge& edge : topology.edges) {
        EXPECT_TRUE(reached[edge.parent]);
        EXPECT_FALSE(reached[edge.child]);
        reached[edge.child] = true;
      }
      EXPECT_EQ(std::ranges::count(reached, true), static_cast<long>(d.bodies.size()));
      EXPECT_EQ(topology.edges.size() + topology.constraints.size(), d.joints.size());
    }
  }
}

TEST(TopologyTest, AFloatingPartHangsOnOneVirtualJoint) {
  MechanismDescription d = FourBar();
  d.joints.erase(d.joints.begin());  // bars hang from the last pin only
  d.joints.pop_back();               // and now from none
  const Topology topology = BuildTopology(d, Coordinates::kJoint);
  EXPECT_EQ(std::ranges::count(topology.edges, -1, &TreeEdge::joint), 1);
  EXPECT_TRUE(topology.constraints.empty());
}

TEST(TopologyTest, ReversedJointsAreWalkedAgainstTheirDirection) {
  MechanismDescription d = FourBar();
  std::swap(d.joints[1].from, d.joints[1].to);
  const Mechanism<Planar, double> mechanism(d, Coordinates::kJoint);
  EXPECT_EQ(mechanism.tree()[0].sign, 1);
  EXPECT_EQ(mechanism.tree()[1].sign, -1);
}

}  // namespace loopbench::topology_test
