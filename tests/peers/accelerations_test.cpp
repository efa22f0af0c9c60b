// Accelerations by a peer's equations at the same states as ours: an independent check of bodies,
// frames, joints, closures, signs of speeds and forces, to round-off.
#include <gtest/gtest.h>

#include "harness/run/run.h"
#include "mechanism/simplify/compile.h"
#include "mechanism/start/assembly.h"
#include "tests/contract/builder.h"
#include "tests/peers/expressible.h"
#include "tests/peers/shared.h"
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

class ShippedAccelerations : public ::testing::TestWithParam<std::string> {};

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

INSTANTIATE_TEST_SUITE_P(All, ShippedAccelerations, ::testing::ValuesIn(reference::ShippedNames()),
                         [](const auto& name) { return reference::WithoutDashes(name.param); });

TEST(CoupledAccelerations, OfGrippersAreSimbodys) {
  for (const double t : {0.0, 0.2}) {
    Compare<Spatial>(peers_test::Gripper(), t);
    Compare<Spatial>(peers_test::GripperWithRotors(), t);
  }
}

}  // namespace peers_accelerations_test
}  // namespace loopbench::harness

namespace loopbench::testing {
namespace {

// Random mechanisms, with joints of every kind in the tree and as closures, the other way round
// too, against the contract's oracle in long double.

template <class Space>
int CompareMany(SpaceKind space) {
  int compared = 0;
  const auto compare = [&](MechanismDescription description, std::uint64_t seed) {
    KeepExpressible(description);
    const auto error = PeerError<Space>("peer/simbody", description, seed);
    if (!error) return;
    EXPECT_LE(error->relative, error->bound) << description.name;
    ++compared;
  };
  for (std::uint64_t seed = 1; seed <= 30; ++seed) {
    compare(AnyMechanism(6, 0, 0, space, seed), seed);
    compare(RandomTree(8, space, seed), seed);
    compare(MixedGraph(2, space, seed), seed);
    compare(TightGraph(space == SpaceKind::kPlanar ? 12 : 24, 2, space, seed), seed);
  }
  return compared;
}

TEST(RandomAccelerations, OfJointsOfEveryKindInThePlaneAreSimbodys) {
  EXPECT_EQ(CompareMany<Planar>(SpaceKind::kPlanar), 120);
}

TEST(RandomAccelerations, OfJointsOfEveryKindInSpaceAreSimbodys) {
  // but for helical joints that close a loop
  EXPECT_GE(CompareMany<Spatial>(SpaceKind::kSpatial), 100);
}

/// Loops of revolute joints and a translation, closed by kinds that mixed graphs do not draw.
TEST(RandomAccelerations, OfClosuresByOtherKindsAreSimbodys) {
  for (const JointType type : {JointType::kTranslation, JointType::kSchoenflies,
                               JointType::kPointOnLine, JointType::kPointInPlane}) {
    for (std::uint64_t seed = 1; seed <= 5; ++seed) {
      Builder b("closed-by-" + std::string(ToString(type)), SpaceKind::kSpatial, seed);
      int last = 0;
      for (int i = 0; i < 7; ++i) {
        const int body = b.AddBody(1.0);
        const Eigen::Vector3d at = b.Tip();
        b.AddJoint(i == 3 ? JointType::kTranslation : JointType::kRevolute, last, at, body,
                   b.random.Vector(0.2, true), b.random.Uniform(-2.0, 2.0));
        last = body;
      }
      b.Close(type, 0, last, b.Tip(), 0.0);
      MechanismDescription loop = b.Finish();
      KeepExpressible(loop);
      const auto error = PeerError<Spatial>("peer/simbody", loop, seed);
      ASSERT_TRUE(error.has_value());
      EXPECT_LE(error->relative, error->bound) << loop.name;
    }
  }
}

TEST(RandomAccelerations, OfClosuresWithReleasedDirectionsAreSimbodys) {
  // axes that meet in one point: three of five rows of the closure say nothing, and rotations
  // decide; of the same mechanism with all five the oracle finds the rank
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    MechanismDescription chain = SphericalChain(4, seed);
    KeepExpressible(chain);
    const MechanismDescription released = Compile(chain, {}).parts.front().description;
    ASSERT_EQ(released.joints.size(), chain.joints.size());
    EXPECT_EQ(released.joints.back().released.size(), 3u);
    const auto error = PeerError<Spatial>("peer/simbody", chain, seed, &released);
    ASSERT_TRUE(error.has_value());
    EXPECT_LE(error->relative, error->bound) << chain.name;
  }
}

TEST(RandomAccelerations, WithRotorsAreSimbodys) {
  EXPECT_GE(CompareRotors<Planar>("peer/simbody", SpaceKind::kPlanar), 20);
  EXPECT_GE(CompareRotors<Spatial>("peer/simbody", SpaceKind::kSpatial), 20);
}

}  // namespace
}  // namespace loopbench::testing
