// The sweep along paths against the general one, which the contract suite holds to an oracle.
#include "mechanism/description/library.h"
#include "odca/path_links.h"
#include "tests/odca/served.h"

namespace loopbench::odca::pins::path_sweep_test {

Both Compare(const Mechanism<Planar, double>& mechanism, SpeedsUsed speeds, const Numbers& q,
             const Numbers& u, int bodies_of_group = kBodiesOfGroup) {
  return odca::Compare(mechanism, MakePathSweep(mechanism, 3, bodies_of_group).get(), speeds, q, u);
}

/// Both right-hand sides.
class PathSweepTest : public ::testing::TestWithParam<SpeedsUsed> {};
INSTANTIATE_TEST_SUITE_P(Speeds, PathSweepTest,
                         ::testing::Values(SpeedsUsed::kGiven, SpeedsUsed::kCompleted));

TEST_P(PathSweepTest, AgreesWithTheGeneralSweepWhereverJointsHaveDrifted) {
  Tally tally, of_long;
  for (int n = 1; n <= 80; ++n) {
    // more than 40 bodies: two paths, of several groups, whose places follow each other
    const bool is_long = n > 40;
    for (std::uint64_t seed = 1; seed <= 12; ++seed) {
      const MechanismDescription path = RandomPath(n, 100 * seed + n, is_long);
      const Mechanism<Planar, double> mechanism(path, Coordinates::kJoint);
      ASSERT_NE(MakePathSweep(mechanism), nullptr) << path.name;
      Random random(seed);
      const Numbers q = RandomNumbers(random, mechanism.num_q(), 4.0);
      const Numbers u = RandomNumbers(random, mechanism.num_u(), 2.0);
      const Both both = is_long ? Compare(mechanism, GetParam(), q, u, 2 * kLanes)
                                : Compare(mechanism, GetParam(), q, u);
      ASSERT_EQ(both.outcome, Outcome::kFinished);
      (is_long ? of_long : tally).Add(both, n, path.name);
    }
  }
  tally.Finish(0.1);
  // long ones have three times as many joints that may be near their limit
  of_long.Finish(0.3);
}

TEST_P(PathSweepTest, AgreesOnChainsAndLadders) {
  const auto hold = [&](const MechanismDescription& description) {
    const Mechanism<Planar, double> mechanism(description, Coordinates::kJoint);
    Random random(1);
    const auto [q, u] = StateNear(description, mechanism, 1e-4, random);
    const Both both = Compare(mechanism, GetParam(), q, u);
    ASSERT_TRUE(both.evaluated) << description.name;
    EXPECT_LE(both.difference, Bound(mechanism.num_bodies(), both.general.rcond))
        << description.name;
  };
  // the last ones are in several groups: 2 and 4
  for (const int n : {3, 4, 8, 9, 16, 31, 100, 400, 4100, 8300}) hold(Chain(n));
  for (const int n : {1, 2, 3, 4, 5, 8, 15, 50, 200, 2060, 4200}) hold(Ladder(n, 1.1, -0.7));
}

/// Several groups in each, of which threads take shares; bodies whose angles follow from bodies of
/// other threads; loops across the ends of groups.
TEST(PathSweep, HasTheSameBitsForAnyNumberOfThreads) {
  Random random(1);
  const auto hold = [&](const MechanismDescription& description, double size, bool evaluates) {
    const Mechanism<Planar, double> mechanism(description, Coordinates::kJoint);
    const auto [q, u] = StateNear(description, mechanism, size, random);
    const auto make = [&](int threads) { return MakePathSweep(mechanism, threads); };
    ExpectTheSameBits(make, mechanism, q, u, evaluates);
  };
  hold(Chain(8300), 1e-4, true);
  hold(Ladder(4200, 1.1, -0.7), 1e-4, true);
  // open, and pinned at its middle: half of it follows the other way
  MechanismDescription arms = Chain(8300);
  std::erase_if(arms.joints, [](const JointDescription& joint) {
    return joint.from.body == kGround || joint.to.body == kGround;
  });
  arms.joints.push_back(Pin(random, kGround, 4000));
  arms.joints.back().name = "pin";
  arms.initial = {};
  hold(arms, 1.0, true);
  MechanismDescription stretched = Chain(8300);
  stretched.initial = {};
  hold(stretched, 0.0, false);
}

TEST(PathSweep, LeavesOthersToTheGeneralSweep) {
  const auto make = [](const MechanismDescription& description) {
    return MakePathSweep(Mechanism<Planar, double>(description, Coordinates::kJoint));
  };
  const MechanismDescription chain = Chain(5);
  EXPECT_EQ(make(Grid(2, 2, 1.0, 0.0)), nullptr) << "bodies with more joints";
  EXPECT_EQ(make(Hub(3, 2, false)), nullptr);
  MechanismDescription elsewhere = chain;
  elsewhere.joints[2].cut = true;
  EXPECT_EQ(make(elsewhere), nullptr) << "cut where no pinned body follows";
}

TEST_P(PathSweepTest, RefusesAChainThatIsStretchedOut) {
  const Mechanism<Planar, double> chain(Chain(4), Coordinates::kJoint);
  const auto sweep = MakePathSweep(chain);
  Numbers u = Numbers::Ones(4), qdot = u, udot = u;
  for (const double angle : {1.1, 0.0}) {  // no force along it moves the last pin
    const Numbers q = Numbers::Constant(4, angle);
    EXPECT_EQ(sweep->Evaluate(GetParam(), nullptr, In(q), In(u), In(qdot), In(udot)), angle > 0.0);
  }
}

TEST(PathSweep, ProjectsNothingNearADegeneratePosition) {
  const MechanismDescription ladder = Ladder(3, 1e-4, 0.5);
  const Mechanism<Planar, double> mechanism(ladder, Coordinates::kJoint);
  Numbers q = testing::DescribedCoordinates(ladder, mechanism), u = Numbers::Ones(q.size());
  q.array() += 1e-7;
  const Numbers q_before = q, u_before = u;
  EXPECT_FALSE(MakePathSweep(mechanism)->Project(In(q), In(u), 1e-15));
  EXPECT_EQ(q, q_before);
  EXPECT_EQ(u, u_before);
}

/// Cranks at an angle from the line in which all bars lie: wherever the general sweep regularizes,
/// by whatever order of joins, the short cut must not answer. It stops answering at 20 times the
/// angle.
TEST(PathSweep, LeavesWhatIsRegularizedToTheGeneralSweep) {
  for (const int windows : {1, 3, 10, 40, 200}) {
    double regularized = 0.0, answered = 1.0;
    for (double angle = 1e-5; angle < 0.3; angle *= 1.3) {
      const MechanismDescription ladder = Ladder(windows, angle, 0.5);
      const Mechanism<Planar, double> mechanism(ladder, Coordinates::kJoint);
      const Numbers q = testing::DescribedCoordinates(ladder, mechanism);
      const Numbers u = Numbers::Ones(mechanism.num_u());
      const Both both = Compare(mechanism, SpeedsUsed::kGiven, q, u);
      if (both.general.smallest_weight < 1.0) regularized = std::max(regularized, angle);
      if (both.evaluated) answered = std::min(answered, angle);
    }
    std::printf("%3d windows: regularized to %.1e rad, answered from %.1e\n", windows, regularized,
                answered);
    EXPECT_GT(regularized, 1e-4) << windows;
    EXPECT_LT(regularized, answered) << windows;
    EXPECT_LT(answered, 0.2) << windows << ": it serves somewhere";
  }
}

TEST(Paths, AreFoundInAnyOrderOfJoints) {
  using Joints = std::vector<PlanJoint>;
  const auto bodies = [](int n, const Joints& joints) {
    std::vector<std::vector<int>> found;
    for (const Path& path : FindPaths(n + 1, joints)) {
      found.emplace_back();
      for (const PathBody& at : path) found.back().push_back(at.body);
    }
    return found;
  };
  using Found = std::vector<std::vector<int>>;
  EXPECT_EQ(bodies(3, Joints{{0, 3, 1, 2}, {1, 2, 3, 2}, {2, 0, 3, 2}}), (Found{{1, 3, 2}}));
  EXPECT_EQ(bodies(3, Joints{{0, 2, 3, 2}, {1, 0, 1, 2}}), (Found{{1}, {2, 3}}));
  EXPECT_EQ(bodies(3, Joints{{0, 1, 2, 2}, {1, 2, 3, 2}, {2, 3, 1, 2}}), Found{}) << "a ring";
  EXPECT_EQ(bodies(2, Joints{{0, 1, 2, 2}, {1, 2, 1, 2}}), Found{}) << "two joints to the same";
  EXPECT_EQ(bodies(1, Joints{{0, 0, 1, 2}, {1, 1, 0, 2}}), Found{}) << "two to Ground";
  EXPECT_EQ(bodies(4, Joints{{0, 1, 2, 2}, {1, 1, 3, 2}, {2, 1, 4, 2}}), Found{}) << "a hub";
}

}  // namespace loopbench::odca::pins::path_sweep_test
