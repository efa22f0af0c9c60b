// Accelerations by a peer's equations at the same states as ours: an independent check of bodies,
// frames, joints, closures, signs of speeds and forces, to round-off.
#include <gtest/gtest.h>

#include "harness/run/run.h"
#include "mechanism/start/assembly.h"
#include "tests/peers/gripper.h"
#include "tests/peers/registered.h"
#include "tests/peers/sensitivity.h"
#include "tests/reference/cases.h"

namespace loopbench::harness {
namespace peers_accelerations_test {

using peers_test::kEps;

/// At the start, and after `t` of O-DCA's run at level projection.
template <class Space>
void Compare(const MechanismDescription& description, double t) {
  const Mechanism<Space, double> mechanism(description, Coordinates::kJoint);
  const Start<double> start = Assemble<Space>(description, mechanism);
  ASSERT_EQ(start.outcome, Outcome::kFinished) << start.message;
  const auto system = MakeFormulation<Space>("odca", mechanism, {Enforcement::kPosition});
  ASSERT_EQ(system->Start(0.0, start.q, start.u), Outcome::kFinished);
  std::vector<double> y(static_cast<std::size_t>(system->state_size()));
  system->ToState(start.q, start.u, y);
  if (t > 0.0) {
    const auto project = [&](double at, std::span<double> state) {
      return system->BeginStep(at, state) ? StepAction::kRestart : StepAction::kContinue;
    };
    ASSERT_EQ(Integrate(*system, 0.0, t, y, {}, project).outcome, Outcome::kFinished);
  }
  std::vector<double> ours(y.size()), theirs(y.size());
  const auto peer = MakePeer("peer/simbody", description);
  ASSERT_EQ(peer->Derivative(t, y, theirs), Outcome::kFinished);
  ASSERT_EQ(system->Examine(t, y, ours), Outcome::kFinished);
  const auto derivative = [&](const std::vector<double>& state) {
    std::vector<double> other(y.size());
    EXPECT_EQ(system->Examine(t, state, other), Outcome::kFinished);
    return other;
  };
  const double largest = peers_test::Largest(ours);
  const double rcond = system->diagnostics().rcond;
  // Both sum some 100 rounded terms in another order, and solve for the loops' forces, which
  // magnifies that by the condition of the loops; in singular positions, where nothing is known of
  // it, the shipped mechanisms have one lost direction and all others well conditioned.
  const double condition = rcond > kEps ? 1.0 / rcond : 1.0;
  EXPECT_LE(peers_test::LargestDifference(ours, theirs),
            100 * (kEps * condition * largest + peers_test::Sensitivity(y, ours, derivative)))
      << "at " << t << " s, of " << largest;
}

/// Time of a short run [s]: Andrews' squeezer turns a thousand times as fast as the others.
double ShortHorizon(const std::string& name) {
  if (name == "andrews-squeezer") return 0.005;
  return name == "flyball-governor" ? 0.02 : 0.2;
}

class ShippedAccelerations : public testing::TestWithParam<std::string> {};

TEST_P(ShippedAccelerations, AreSimbodys) {
  const MechanismFile file = reference::Shipped(GetParam());
  const SimplifiedProblem problem = SimplifyProblem(file.description, file.observe, {});
  for (const auto& [description, images] : problem.compiled.parts) {
    for (const double t : {0.0, ShortHorizon(GetParam())}) {
      try {
        description.space == SpaceKind::kPlanar ? Compare<Planar>(description, t)
                                                : Compare<Spatial>(description, t);
      } catch (const Inexpressible& why) {
        const auto expected = peers_test::kInexpressible.find(GetParam());
        ASSERT_NE(expected, peers_test::kInexpressible.end()) << why.what();
        EXPECT_EQ(why.what(), expected->second);
      }
    }
  }
}

INSTANTIATE_TEST_SUITE_P(All, ShippedAccelerations, testing::ValuesIn(reference::ShippedNames()),
                         [](const auto& name) { return reference::WithoutDashes(name.param); });

TEST(CoupledAccelerations, OfGrippersAreSimbodys) {
  for (const double t : {0.0, 0.2}) {
    Compare<Spatial>(peers_test::Gripper(), t);
    Compare<Spatial>(peers_test::GripperWithRotors(), t);
  }
}

}  // namespace peers_accelerations_test
}  // namespace loopbench::harness
