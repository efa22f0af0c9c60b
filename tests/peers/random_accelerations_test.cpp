// Accelerations of random mechanisms by a peer's equations, with joints of every kind in the tree
// and as closures, the other way round too, against the contract's oracle.
#include <gtest/gtest.h>

#include "harness/run/peers.h"
#include "tests/contract/sample.h"
#include "tests/peers/registered.h"

namespace loopbench::testing {
namespace {

/// What peers have of the forces.
void KeepExpressible(MechanismDescription& description) {
  const Topology topology = BuildTopology(description, Coordinates::kJoint);
  const auto is_cut = [&](int joint) {
    return std::ranges::find(topology.constraints, joint) != topology.constraints.end();
  };
  std::erase_if(description.forces, [&](const ForceDescription& force) {
    if (const auto* spring = std::get_if<JointSpring>(&force)) return is_cut(spring->joint);
    if (const auto* damper = std::get_if<JointDamper>(&force)) return is_cut(damper->joint);
    if (const auto* point = std::get_if<PointForce>(&force)) return point->in_body_axes;
    return !std::holds_alternative<SpringDamper>(force);
  });
  // Simbody holds moments of inertia to the triangle inequality, as bodies of matter do
  for (BodyDescription& body : description.bodies) {
    body.inertia += 0.5 * body.inertia.trace() * Eigen::Matrix3d::Identity();
  }
}

/// Draws as the contract of formulations has them, against its oracle in long double.
template <class Space>
void CompareWithOracle(MechanismDescription description, std::uint64_t seed, int* compared) {
  KeepExpressible(description);
  std::unique_ptr<harness::Peer> peer;
  try {
    peer = harness::MakePeer("peer/simbody", description);
  } catch (const harness::Inexpressible& why) {
    // the one kind of closure that Simbody lacks
    EXPECT_NE(std::string(why.what()).find("helical, which closes a loop"), std::string::npos)
        << why.what();
    return;
  }
  const Sample<Space> sample(description, seed);
  const State& state = sample.state(Coordinates::kJoint);
  std::vector<double> y(state.q.begin(), state.q.end());
  y.insert(y.end(), state.u.begin(), state.u.end());
  std::vector<double> ydot(y.size());
  ASSERT_EQ(peer->Derivative(0.0, y, ydot), Outcome::kFinished);
  const VectorX<double> udot =
      Eigen::Map<VectorX<double>>(ydot.data() + state.q.size(), state.u.size());
  EXPECT_LE(RelativeError(udot, sample.udot(Coordinates::kJoint)), sample.Bound())
      << description.name;
  ++*compared;
}

template <class Space>
int CompareMany(SpaceKind space) {
  int compared = 0;
  for (std::uint64_t seed = 1; seed <= 40; ++seed) {
    CompareWithOracle<Space>(RandomTree(8, space, seed), seed, &compared);
    CompareWithOracle<Space>(MixedGraph(2, space, seed), seed, &compared);
    CompareWithOracle<Space>(TightGraph(space == SpaceKind::kPlanar ? 12 : 24, 2, space, seed),
                             seed, &compared);
  }
  return compared;
}

TEST(RandomAccelerations, OfJointsOfEveryKindInThePlaneAreSimbodys) {
  EXPECT_EQ(CompareMany<Planar>(SpaceKind::kPlanar), 120);
}

TEST(RandomAccelerations, OfJointsOfEveryKindInSpaceAreSimbodys) {
  EXPECT_GE(CompareMany<Spatial>(SpaceKind::kSpatial), 60);
}

}  // namespace
}  // namespace loopbench::testing
