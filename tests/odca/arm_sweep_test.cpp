// The sweep along arms against the general one, which the contract suite holds to an oracle.
#include "mechanism/description/library.h"
#include "mechanism/description/transforms.h"
#include "odca/arm_links.h"
#include "tests/odca/served.h"

namespace loopbench::odca::arms::arm_sweep_test {

Both Compare(const Mechanism<Spatial, double>& mechanism, SpeedsUsed speeds, const Numbers& q,
             const Numbers& u, int bodies_of_group = kBodiesOfGroup) {
  return odca::Compare(mechanism, MakeArmSweep(mechanism, 3, bodies_of_group).get(), speeds, q, u);
}

/// Both right-hand sides.
class ArmSweepTest : public ::testing::TestWithParam<SpeedsUsed> {};
INSTANTIATE_TEST_SUITE_P(Speeds, ArmSweepTest,
                         ::testing::Values(SpeedsUsed::kGiven, SpeedsUsed::kCompleted));

/// Angles are drawn at random, so cut joints are as far apart as the bodies are long.
TEST_P(ArmSweepTest, AgreesWithTheGeneralSweepWhereverJointsHaveDrifted) {
  std::vector<Paths> shapes = {{.open = 1000}, {.closed = 1000}};
  for (const int n : {1, 2, 3, 7, 8, 9, 16, 17, 33, 64, 100}) {
    shapes.push_back({.open = n});
    shapes.push_back({.open = n, .closed = 11, .also_closed = n});
    if (n < 7) continue;  // fewer bodies have no freedom, a test of its own
    for (const JointType cut :
         {JointType::kRevolute, JointType::kSpherical, JointType::kPrismatic,
          JointType::kCylindrical, JointType::kWeld, JointType::kTranslation,
          JointType::kSchoenflies, JointType::kPointOnLine, JointType::kPointInPlane}) {
      shapes.push_back({.closed = n, .cut = cut});
    }
  }
  Tally tally;
  for (const Paths& shape : shapes) {
    const int bodies = shape.open + shape.closed + shape.also_closed;
    for (std::uint64_t seed = 1; seed <= (bodies < 1000 ? 12u : 2u); ++seed) {
      const MechanismDescription arms = RandomArms(shape, 100 * seed + bodies);
      const Mechanism<Spatial, double> mechanism(arms, Coordinates::kJoint);
      Random random(seed);
      const Numbers q = RandomNumbers(random, mechanism.num_q(), 4.0);
      const Numbers u = RandomNumbers(random, mechanism.num_u(), 2.0);
      const Both both = seed % 2 == 0 ? Compare(mechanism, GetParam(), q, u, 4 * kLanes)
                                      : Compare(mechanism, GetParam(), q, u);
      ASSERT_EQ(both.outcome, Outcome::kFinished);
      tally.Add(both, bodies, arms.name);
    }
  }
  tally.Finish(0.05);
}

/// Two to five bodies between pins on Ground have no freedom, and one redundant row or more.
TEST_P(ArmSweepTest, LeavesLoopsWithoutFreedomToTheGeneralSweep) {
  int refused = 0;
  for (int n = 1; n <= 4; ++n) {
    for (std::uint64_t seed = 1; seed <= 10; ++seed) {
      const Mechanism<Spatial, double> mechanism(RandomArms({.closed = n}, seed),
                                                 Coordinates::kJoint);
      EXPECT_EQ(MakeArmSweep(mechanism), nullptr);
      ++refused;
    }
  }
  std::printf("%d refused\n", refused);
}

/// Against long double, at consistent states of closed loops; the general sweep beside it.
TEST(ArmSweep, AgreesWithTheOracle) {
  double worst = 0.0, worst_general = 0.0;
  for (const int n : {7, 8, 12, 20}) {
    for (std::uint64_t seed = 1; seed <= 8; ++seed) {
      const MechanismDescription chain = testing::RandomChain(n, SpaceKind::kSpatial, seed);
      MechanismDescription free = chain;
      free.forces.clear();
      const Mechanism<Spatial, double> mechanism(free, Coordinates::kJoint);
      const testing::State state = testing::ConsistentState(free, mechanism, seed);
      const auto sweep = MakeArmSweep(mechanism);
      ASSERT_NE(sweep, nullptr) << chain.name;
      Numbers qdot(state.u.size()), own(state.u.size()), general;
      const testing::Answer exact =
          testing::Oracle(free, testing::LayoutOf(mechanism))
              .Solve(state.q.cast<testing::Real>(), state.u.cast<testing::Real>());
      if (!sweep->Evaluate(SpeedsUsed::kGiven, nullptr, In(state.q), In(state.u), In(qdot),
                           In(own))) {
        EXPECT_LT(exact.rcond, 0.01) << chain.name;
        continue;
      }
      testing::SystemWith<Odca, Spatial, double> odca(mechanism, {});
      ASSERT_EQ(odca->Evaluate(0.0, state.q, state.u, general), Outcome::kFinished);
      const Numbers udot = exact.udot.cast<double>();
      const double size =
          std::max({udot.cwiseAbs().maxCoeff(), mechanism.gravity().norm(), state.u.squaredNorm()});
      const auto of_bound = [&](const Numbers& own_udot) {
        return (own_udot - udot).cwiseAbs().maxCoeff() / size / Bound(n, exact.rcond);
      };
      EXPECT_LE(of_bound(own), 1.0) << chain.name << " rcond " << exact.rcond;
      worst = std::max(worst, of_bound(own));
      worst_general = std::max(worst_general, of_bound(general));
    }
  }
  std::printf("worst %.2g of the bound, general sweep %.2g\n", worst, worst_general);
  EXPECT_GT(worst, 0.0) << "else this test says nothing";
}

/// Several groups, of which threads take shares.
TEST(ArmSweep, HasTheSameBitsForAnyNumberOfThreads) {
  for (const Paths& shape : {Paths{.open = 900}, Paths{.open = 300, .closed = 500}}) {
    const Mechanism<Spatial, double> mechanism(RandomArms(shape, 5), Coordinates::kJoint);
    Random random(1);
    const Numbers q = RandomNumbers(random, mechanism.num_q(), 1.0);
    const Numbers u = RandomNumbers(random, mechanism.num_u(), 1.0);
    const auto make = [&](int threads) { return MakeArmSweep(mechanism, threads, 200); };
    ExpectTheSameBits(make, mechanism, q, u, true);
  }
}

/// A chain that hangs from a body of another one.
MechanismDescription Branching() {
  Builder b("branching", SpaceKind::kSpatial, 1);
  AddPath(b, 5, false, JointType::kRevolute);
  AddPath(b, 3, false, JointType::kRevolute);
  for (JointSide* side : {&b.description.joints[5].from, &b.description.joints[5].to}) {
    if (side->body == kGround) side->body = 3;
  }
  return b.description;
}

TEST(ArmSweep, LeavesOthersToTheGeneralSweep) {
  const auto make = [](const MechanismDescription& description) {
    return MakeArmSweep(Mechanism<Spatial, double>(description, Coordinates::kJoint));
  };
  MechanismDescription cross = RandomArms({.closed = 9}, 1);
  for (JointDescription& joint : cross.joints) {
    if (joint.cut) joint.type = JointType::kUniversal;
  }
  EXPECT_EQ(make(cross), nullptr) << "directions that depend on the position";
  EXPECT_EQ(make(Branching()), nullptr) << "a body that carries two";
  EXPECT_EQ(make(InSpace(Ladder(2, 1.0, 0.5), {0.1, 0.2, 0.3})), nullptr)
      << "two loops share a body";
  EXPECT_EQ(make(InSpace(Chain(6), {0.1, 0.2, 0.3})), nullptr)
      << "parallel axes: three rows redundant everywhere";
  EXPECT_EQ(make(testing::SphericalChain(6, 1)), nullptr) << "axes through one point, likewise";
}

}  // namespace loopbench::odca::arms::arm_sweep_test
