// Accelerations by a peer's equations at the same states as ours: an independent check of bodies,
// frames, joints, closures, signs of speeds and forces, to round-off.
#include <gtest/gtest.h>

#include <limits>
#include <random>

#include "harness/run/compiled_scene.h"
#include "harness/run/peers.h"
#include "mechanism/start/assembly.h"
#include "tests/peers/registered.h"
#include "tests/reference/cases.h"

namespace loopbench::harness {
namespace peers_accelerations_test {

constexpr double kEps = std::numeric_limits<double>::epsilon();

double LargestDifference(std::span<const double> a, std::span<const double> b) {
  double largest = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    // written so that a NaN stays
    if (!(std::abs(a[i] - b[i]) <= largest)) largest = std::abs(a[i] - b[i]);
  }
  return largest;
}

/// How far the derivative moves when the state does in its last bits: what round-off in a state,
/// and in sums of forces that nearly cancel, does to accelerations.
template <class Space>
double Sensitivity(System<Space, double>& system, std::span<const double> y,
                   std::span<const double> ydot) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> bits(-kEps, kEps);
  std::vector<double> near(y.size()), other(y.size());
  double largest = 0.0;
  for (int draw = 0; draw < 16; ++draw) {
    for (std::size_t i = 0; i < y.size(); ++i) {
      near[i] = y[i] + bits(random) * std::max(1.0, std::abs(y[i]));
    }
    EXPECT_EQ(system.Examine(0.0, near, other), Outcome::kFinished);
    largest = std::max(largest, LargestDifference(ydot, other));
  }
  return largest;
}

/// At the start, and after `t` of O-DCA's run at level position.
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
  double largest = 0.0;
  for (const double value : ours) largest = std::max(largest, std::abs(value));
  const double rcond = system->diagnostics().rcond;
  // Both sum some 100 rounded terms in another order, and solve for the loops' forces, which
  // magnifies that by the condition of the loops; in singular positions, where nothing is known of
  // it, the shipped mechanisms have one lost direction and all others well conditioned.
  const double condition = rcond > kEps ? 1.0 / rcond : 1.0;
  EXPECT_LE(LargestDifference(ours, theirs),
            100 * (kEps * condition * largest + Sensitivity(*system, y, ours)))
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
  const CompiledScene scene = CompileScene(file.description, file.observe, {});
  for (const auto& [description, images] : scene.compiled.parts) {
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

}  // namespace peers_accelerations_test
}  // namespace loopbench::harness
