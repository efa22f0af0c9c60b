// MuJoCo: trees to round-off, closures as far as they are soft.
#include <gtest/gtest.h>

#include <map>

#include "mechanism/start/assembly.h"
#include "tests/peers/expressible.h"
#include "tests/peers/shared.h"
#include "tests/reference/cases.h"

namespace loopbench::testing {
namespace {

using harness::reference::RunFile;
using harness::reference::RunShipped;
using harness::reference::Shipped;

const harness::Method kMujoco = {"peer/mujoco", Enforcement::kBaumgarte};
const harness::Method kOdca = {"odca", Enforcement::kPosition};

/// Trees of joints of these kinds with forces of every kind; how many of them MuJoCo has.
template <class Space>
int CompareTrees(SpaceKind space, DrawnKinds kinds = DrawnKinds::kUpToHelical) {
  int compared = 0;
  for (std::uint64_t seed = 1; seed <= 60; ++seed) {
    MechanismDescription tree = AnyMechanism(6, 0, 0, space, seed, kinds);
    KeepExpressible(tree);
    const auto error = PeerError<Space>("peer/mujoco", tree, seed);
    if (!error) continue;
    EXPECT_LE(error->relative, error->bound) << tree.name;
    ++compared;
  }
  return compared;
}

TEST(MujocoTrees, InThePlaneHaveTheOraclesAccelerations) {
  EXPECT_EQ(CompareTrees<Planar>(SpaceKind::kPlanar), 60);
}

TEST(MujocoTrees, InSpaceHaveTheOraclesAccelerations) {
  EXPECT_GE(CompareTrees<Spatial>(SpaceKind::kSpatial), 20);  // others have helical joints
  EXPECT_GE(CompareTrees<Spatial>(SpaceKind::kSpatial, DrawnKinds::kAll), 20);
}

TEST(MujocoTrees, WithRotorsHaveOurAccelerations) {
  EXPECT_GE(CompareRotors<Planar>("peer/mujoco", SpaceKind::kPlanar), 20);
  // others have helical joints
  EXPECT_GE(CompareRotors<Spatial>("peer/mujoco", SpaceKind::kSpatial), 5);
}

/// Largest difference to O-DCA's accelerations, over the largest of these, at the four-bar's start
/// with its crank turning.
double ErrorOfFourBar(double speed) {
  MechanismDescription four_bar = Shipped("four-bar").description;
  four_bar.initial.speeds = {{0, {speed}}};
  const Mechanism<Planar, double> mechanism(four_bar, Coordinates::kJoint);
  const Start<double> start = Assemble<Planar>(four_bar, mechanism);
  const auto system = harness::MakeFormulation<Planar>("odca", mechanism, {});
  EXPECT_EQ(system->Start(0.0, start.q, start.u), Outcome::kFinished);
  std::vector<double> y(6), ydot(6), theirs(6);
  system->ToState(start.q, start.u, y);
  EXPECT_EQ(system->Examine(0.0, y, ydot), Outcome::kFinished);
  EXPECT_EQ(harness::MakePeer("peer/mujoco", four_bar)->Derivative(0.0, y, theirs),
            Outcome::kFinished);
  double largest = 0.0, difference = 0.0;
  for (std::size_t i = 3; i < 6; ++i) {
    largest = std::max(largest, std::abs(ydot[i]));
    difference = std::max(difference, std::abs(theirs[i] - ydot[i]));
  }
  return difference / largest;
}

TEST(MujocoClosures, LeaveAShareOfAccelerationsAndAllThatComesWithSpeed) {
  // a share of 1e-4 of the closure's acceleration, some times that of the joints
  EXPECT_LE(ErrorOfFourBar(0.0), 1e-3);
  EXPECT_GE(ErrorOfFourBar(1.0), 1e-2);
}

/// Runs with steps too long for the mechanism's fast modes end with a name.
const std::map<std::string, std::string> kUnstable = {{"elastic-crank", "integrator-error"},
                                                      {"flyball-governor", "integrator-error"}};
const std::map<std::string, std::string> kInexpressible = {
    {"driven-four-bar", "peer/mujoco does not have: joint \"OA\": a prescribed motion"},
    {"screw-jack",
     "peer/mujoco does not have: joint_torque along joint \"bearing\", which depends on time; "
     "joint "
     "\"thread\": helical; joint \"guide\": prismatic, which closes a loop"}};

/// Returns the difference of the final poses from O-DCA's.
double EndError(const harness::MechanismFile& file, double tolerance, double horizon) {
  const harness::Record theirs = RunFile(file, kMujoco, tolerance, horizon);
  const harness::Record ours = RunFile(file, kOdca, 1e-10, horizon);
  EXPECT_EQ(theirs.Text("outcome"), "finished") << theirs.Text("message");
  return harness::peers_test::EndDifference(ours, theirs);
}

class ShippedMujoco : public ::testing::TestWithParam<std::string> {};

TEST_P(ShippedMujoco, ComesCloserToOursWithTheSquareOfTheStep) {
  // Andrews' squeezer turns a thousand times as fast as the others
  const bool fast = GetParam() == "andrews-squeezer";
  const double horizon = fast ? 0.005 : 0.2, coarse = fast ? 1e-14 : 1e-6;
  if (const auto why = kInexpressible.find(GetParam()); why != kInexpressible.end()) {
    const harness::Record run = RunShipped(GetParam(), kMujoco, coarse, horizon);
    EXPECT_EQ(run.Text("outcome"), "unsupported");
    EXPECT_EQ(run.Text("message"), why->second);
    return;
  }
  if (const auto ending = kUnstable.find(GetParam()); ending != kUnstable.end()) {
    const harness::Record run = RunShipped(GetParam(), kMujoco, coarse, horizon);
    EXPECT_EQ(run.Text("outcome"), ending->second);
    EXPECT_NE(run.Text("message").find("unstable"), std::string::npos);
    return;
  }
  // a hundredth of the tolerance is 10^(-1/2) of the step, which leaves a tenth; what is below
  // 1e-10 m or rad is the error of our own run
  const harness::MechanismFile file = Shipped(GetParam());
  const double error = EndError(file, coarse, horizon);
  EXPECT_LE(EndError(file, 0.01 * coarse, horizon), 0.2 * error + 1e-10);
  EXPECT_LE(error, 0.03);
}

INSTANTIATE_TEST_SUITE_P(All, ShippedMujoco,
                         ::testing::ValuesIn(harness::reference::ShippedNames()),
                         [](const auto& name) {
                           return harness::reference::WithoutDashes(name.param);
                         });

TEST(MujocoCouplings, AGripperThatMimicsMovesLikeOurs) {
  harness::MechanismFile file;
  file.description = harness::peers_test::Gripper();
  file.canonical = file.description.name;
  // as above: a tenth by a hundredth of the tolerance
  const double error = EndError(file, 1e-6, 0.5);
  EXPECT_LE(EndError(file, 1e-8, 0.5), 0.2 * error + 1e-10);
  EXPECT_LE(error, 1e-3);
}

}  // namespace
}  // namespace loopbench::testing
