// Paths side by side against each of them alone: the same bits, whoever is in the other lanes.
#include "mechanism/description/library.h"
#include "tests/odca/served.h"

namespace loopbench::odca::pins::path_lane_test {

/// As many numbers for each lane.
std::vector<Lanes> Lane(const std::vector<Numbers>& of_lanes) {
  std::vector<Lanes> all(static_cast<std::size_t>(of_lanes[0].size()));
  for (std::size_t i = 0; i < all.size(); ++i) {
    for (int lane = 0; lane < kLanes; ++lane) all[i][lane] = of_lanes[lane][i];
  }
  return all;
}

/// The same bodies and joints with other sizes: lengths, masses, angles of frames.
MechanismDescription Resized(MechanismDescription description, Random& random) {
  for (BodyDescription& body : description.bodies) {
    if (body.mass == 0.0) continue;
    const double factor = random.Uniform(0.5, 2.0);
    body.mass *= factor;
    body.inertia *= factor;
  }
  for (JointDescription& joint : description.joints) {
    joint.from.position *= random.Uniform(0.9, 1.1);
    joint.to.rotation.z() += random.Uniform(-0.1, 0.1);
  }
  return description;
}

/// Both right-hand sides.
class PathLaneTest : public ::testing::TestWithParam<SpeedsUsed> {};
INSTANTIATE_TEST_SUITE_P(Speeds, PathLaneTest,
                         ::testing::Values(SpeedsUsed::kGiven, SpeedsUsed::kCompleted));

TEST_P(PathLaneTest, HasTheBitsOfOneAlone) {
  int states = 0, refused = 0;
  for (int n = 1; n < 2 * kLanes; ++n) {
    for (std::uint64_t seed = 1; seed <= 40; ++seed) {
      const MechanismDescription path = RandomPath(n, 100 * seed + n);
      Random random(seed);
      std::vector<Mechanism<Planar, double>> mechanisms;
      std::vector<std::unique_ptr<ShortCut<Planar>>> alone;
      std::vector<Numbers> q, u;
      std::unique_ptr<ShortCut<Planar, Lanes>> lanes;
      for (int lane = 0; lane < kLanes; ++lane) {
        const Mechanism<Planar, double> mechanism(Resized(path, random), Coordinates::kJoint);
        alone.push_back(MakePathSweep(mechanism));
        if (lane == 0) lanes = MakePathLanes(*alone[0]);
        ASSERT_NE(lanes, nullptr) << path.name;
        ASSERT_TRUE(SetMechanism(*lanes, lane, *alone.back()));
        q.push_back(RandomNumbers(random, mechanism.num_q(), 4.0));
        u.push_back(RandomNumbers(random, mechanism.num_u(), 2.0));
      }
      if (seed % 4 == 0) q[1][0] = std::numeric_limits<double>::quiet_NaN();  // its own affair
      const std::vector<Lanes> all_q = Lane(q), all_u = Lane(u);
      std::vector<Lanes> qdot(all_q.size()), udot = qdot;
      const LaneBits good = lanes->Evaluate(GetParam(), nullptr, all_q, all_u, qdot, udot);
      for (int lane = 0; lane < kLanes; ++lane) {
        Numbers own_qdot = Numbers::Zero(n), own_udot = own_qdot;
        const bool evaluated = alone[lane]->Evaluate(GetParam(), nullptr, In(q[lane]), In(u[lane]),
                                                     In(own_qdot), In(own_udot));
        ++states;
        refused += !evaluated;
        ASSERT_EQ(good[lane] != 0, evaluated) << n << " bodies, seed " << seed;
        if (!evaluated) continue;
        for (int i = 0; i < n; ++i) {
          ASSERT_EQ(qdot[i][lane], own_qdot[i]) << n << " bodies, seed " << seed;
          ASSERT_EQ(udot[i][lane], own_udot[i]) << n << " bodies, seed " << seed;
        }
      }
    }
  }
  EXPECT_GT(refused, 0) << "else nothing was refused beside others";
  // an eighth are no numbers where there are two lanes, and a twentieth near their limits at most
  // (path_sweep_test.cpp)
  EXPECT_LT(5 * refused, states);
}

TEST(PathLane, HasOnlyMechanismsOfOneShape) {
  const auto sweep = [](const MechanismDescription& description) {
    return MakePathSweep(Mechanism<Planar, double>(description, Coordinates::kJoint));
  };
  const auto three = sweep(Chain(3));
  const auto lanes = MakePathLanes(*three);
  EXPECT_TRUE(SetMechanism(*lanes, 1, *sweep(Chain(3))));
  EXPECT_FALSE(SetMechanism(*lanes, 1, *sweep(Chain(4))));
  EXPECT_FALSE(SetMechanism(*lanes, 1, *sweep(Ladder(1, 1.1, 0.0))));
  MechanismDescription open = Chain(3);
  open.joints.pop_back();
  open.initial = {};
  EXPECT_FALSE(SetMechanism(*lanes, 1, *sweep(open)));
  EXPECT_EQ(MakePathLanes(*sweep(Chain(2 * kLanes))), nullptr) << "its pieces fill the lanes";
}

/// Runs of which each asks by itself.
struct OneAfterAnother final : SideBySide {
  void Meet() override {
    for (const auto& work : works) work->Do();
  }
};

TEST_P(PathLaneTest, ServesSolversOfRunsSideBySide) {
  const Mechanism<Planar, double> mechanism(Ladder(2, 1.1, -0.7), Coordinates::kJoint);
  const Mechanism<Planar, double> other(Chain(4), Coordinates::kJoint);
  Kinematics<Planar, double> kinematics(mechanism);
  Random random(1);
  Numbers q = RandomNumbers(random, mechanism.num_q(), 0.1);
  q.array() += 1.1;
  const Numbers u = RandomNumbers(random, mechanism.num_u(), 1.0);
  const auto rates = [&](Odca<Planar, double>& solver) {
    Numbers qdot = Numbers::Zero(u.size()), udot = qdot;
    EXPECT_TRUE(solver.RightHandSide(GetParam(), kinematics, In(q), In(u), In(qdot), In(udot)));
    Numbers all(2 * u.size());
    all << qdot, udot;
    return all;
  };
  Odca<Planar, double> alone(mechanism, {});
  const Numbers expected = rates(alone);
  OneAfterAnother beside;
  std::vector<std::unique_ptr<Odca<Planar, double>>> solvers;
  const auto add = [&](const Mechanism<Planar, double>& one) {
    solvers.push_back(
        std::make_unique<Odca<Planar, double>>(one, FormulationOptions{.beside = &beside}));
  };
  for (int i = 0; i < kLanes; ++i) add(mechanism);
  EXPECT_EQ(beside.works.size(), 1u);
  for (const auto& solver : solvers) EXPECT_EQ(rates(*solver), expected);
  add(mechanism);  // one more than there are lanes
  EXPECT_EQ(beside.works.size(), 2u);
  EXPECT_EQ(rates(*solvers.back()), expected);
  add(other);
  EXPECT_EQ(beside.works.size(), 3u);
  solvers.clear();
  for (int i = 0; i < kLanes; ++i) add(mechanism);
  EXPECT_EQ(beside.works.size(), 3u) << "lanes that were given back are taken again";
  EXPECT_EQ(rates(*solvers.back()), expected);

  if (testing::CountAllocations() < 0) return;
  Numbers qdot = u, udot = u;
  const long before = testing::CountAllocations();
  EXPECT_TRUE(solvers[0]->RightHandSide(GetParam(), kinematics, In(q), In(u), In(qdot), In(udot)));
  EXPECT_EQ(testing::CountAllocations(), before);
}

}  // namespace loopbench::odca::pins::path_lane_test
