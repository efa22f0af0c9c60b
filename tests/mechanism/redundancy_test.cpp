// Which constraints are redundant at generic positions, and what is left without them.
#include "mechanism/simplify/redundancy.h"

#include "mechanism/loops/scaled_loops.h"
#include "mechanism/loops/self_stress.h"
#include "tests/mechanism/shipped.h"

namespace loopbench::redundancy_test {

using testing::Shipped;

int Count(const std::vector<Released>& released,
          std::vector<int> Released::*which = &Released::directions) {
  int count = 0;
  for (const Released& out : released) count += static_cast<int>((out.*which).size());
  return count;
}
int CountMoving(const Redundancy& found) { return Count(found.released, &Released::moving); }

struct Known {
  const char* name;
  int rows, rank;  ///< of the loops at generic positions, from the literature or by counting
};

void PrintTo(const Known& known, std::ostream* out) { *out << known.name; }

class RedundancyOf : public ::testing::TestWithParam<Known> {};

TEST_P(RedundancyOf, IsWhatIsKnown) {
  const auto& [name, rows, rank] = GetParam();
  const Redundancy found = FindRedundancy(Shipped(name));
  EXPECT_EQ(found.rows, rows);
  EXPECT_EQ(found.rank, rank);
  EXPECT_EQ(Count(found.released), rows - rank);
}

template <class Space>
void ExpectIndependent(const MechanismDescription& description, int rank) {
  const testing::Assembled<Space> at(description);
  EXPECT_EQ(at.mechanism.num_rows(), rank);
  const LoopSpectrum spectrum = SpectrumOfLoops(at.kinematics);
  EXPECT_EQ(spectrum.rank, rank) << "what is imposed is independent";
  EXPECT_LT(spectrum.largest / spectrum.singular_values[rank - 1], 50.0) << "and well so";
}

TEST_P(RedundancyOf, LeavesIndependentConstraints) {
  const auto& [name, rows, rank] = GetParam();
  const MechanismDescription description = Shipped(name);
  const MechanismDescription released = Release(description, FindRedundancy(description));
  ForSpace(description.space,
           [&, rank = rank]<class Space>(Space) { ExpectIndependent<Space>(released, rank); });
}

INSTANTIATE_TEST_SUITE_P(
    Mechanisms, RedundancyOf,
    ::testing::Values(Known{"bennett", 5, 2}, Known{"sarrus", 5, 4}, Known{"goldberg", 5, 3},
                      Known{"four-bar-in-space", 5, 2}, Known{"parallelogram-in-space", 5, 2},
                      Known{"three-cranks", 4, 3}, Known{"locomotive", 4, 3},
                      Known{"seven-bar", 4, 4}, Known{"spatial-four-bar", 3, 3},
                      Known{"stewart-platform", 15, 15}, Known{"screw-jack", 5, 1},
                      Known{"driven-four-bar", 2, 2}),
    [](const auto& one) {
      std::string name = one.param.name;
      std::erase(name, '-');
      return name;
    });

TEST(RedundancyTest, ASingularStartIsNoRedundancy) {
  for (const char* name : {"parallelogram-singular-start", "toggle-singular-start"}) {
    const Redundancy found = FindRedundancy(Shipped(name));
    EXPECT_EQ(found.rank_at_start, 1) << name;
    EXPECT_EQ(found.rank, 2) << name;
    EXPECT_TRUE(found.released.empty()) << name;
  }
}

TEST(RedundancyTest, NothingIsReleasedWhereEverythingNearIsSingular) {
  for (const int windows : {2, 10, 40}) {  // flat: few of the windows open on a walk
    const Redundancy found = FindRedundancy(Ladder(windows, 0.0, 0.0));
    EXPECT_EQ(found.rank_at_start, windows);
    EXPECT_EQ(found.rank, 2 * windows);
    EXPECT_TRUE(found.released.empty()) << windows;
  }
}

TEST(RedundancyTest, RowsMoveWhereNoJointKeepsItsNumber) {
  const MechanismDescription plate = Shipped("../experiments/overconstrained/plate-on-cranks");
  const Redundancy found = FindRedundancy(plate);
  EXPECT_EQ(found.rows, 4);
  EXPECT_EQ(found.rank, 3);
  EXPECT_EQ(Count(found.released), 2);
  EXPECT_EQ(CountMoving(found), 1);
  // pivots in line: both loops are singular in the same positions
  for (const char* name : {"three-cranks", "locomotive"}) {
    EXPECT_EQ(CountMoving(FindRedundancy(Shipped(name))), 0) << name;
  }
  // a plate on a plate: no position of a walk need be near a flat loop of both
  for (const auto& [lower, upper] : {std::pair{1.0, 0.5}, {0.3, 2.0}, {2.0, 0.2}, {-1.0, 0.9}}) {
    MechanismDescription tower = plate, top = plate;
    for (const auto& [one, angle] : {std::pair{&tower, lower}, {&top, upper}}) {
      for (JointValues& values : one->initial.coordinates) {
        values.values[0] = values.joint < 3 ? angle : -angle;
      }
    }
    top.initial.held.clear();
    tower = testing::Beside(tower, top, "-top");
    for (JointDescription& joint : tower.joints) {
      if (joint.name.starts_with("ground") && joint.name.ends_with("-top")) joint.from.body = 4;
    }
    const Redundancy two = FindRedundancy(tower);
    EXPECT_EQ(two.rank, 6) << lower << " " << upper;
    EXPECT_EQ(CountMoving(two), 2) << lower << " " << upper;
  }
}

TEST(RedundancyTest, GuessesAreComparedWhereRowsMove) {
  const MechanismDescription given = Shipped("../experiments/overconstrained/plate-on-cranks");
  const MechanismDescription released = Release(given, FindRedundancy(given));
  const testing::Assembled<> at(released);
  ASSERT_EQ(at.mechanism.num_moving_rows(), 1);
  EXPECT_TRUE(FindMissedGuesses(released, at.start.q).empty());
}

TEST(RedundancyTest, EachPartHasTheChoiceItWouldHaveAlone) {
  const MechanismDescription bennett = Shipped("bennett");
  const Redundancy alone = FindRedundancy(bennett);
  ASSERT_EQ(alone.released.size(), 1u);
  const Redundancy both = FindRedundancy(testing::Beside(bennett, bennett));
  EXPECT_EQ(both.rank, 2 * alone.rank);
  ASSERT_EQ(both.released.size(), 2u);
  for (const Released& out : both.released) {
    EXPECT_EQ(out.directions, alone.released[0].directions);
  }
  EXPECT_EQ(both.released[1].joint, alone.released[0].joint + 4);
  // beside a chain that cannot move, whose own constraints are lost at this position only
  const MechanismDescription taut = testing::TautChain(3, SpaceKind::kSpatial);
  const Redundancy found = FindRedundancy(testing::Beside(bennett, taut));
  ASSERT_EQ(found.released.size(), 1u);
  EXPECT_EQ(found.released[0], alone.released[0]);
}

TEST(RedundancyTest, TwoHingesOfADoorNeedOne) {
  const Redundancy found = FindRedundancy(testing::Door());
  EXPECT_EQ(found.rows, 5);
  EXPECT_EQ(found.rank, 0);
  EXPECT_EQ(Count(found.released), 5);
}

TEST(RedundancyTest, CouplingsThatFollowFromLoopsReplaceConstraints) {
  MechanismDescription d = Shipped("sarrus");
  const auto find = [&](std::vector<CouplingDescription> couplings) {
    d.couplings = std::move(couplings);
    return FindRedundancy(d);
  };
  // plates of both legs turn alike; the platform does not turn
  const CouplingDescription legs{"legs", {{0, 1.0}, {3, 1.0}}},
      level{"level", {{0, 1.0}, {1, 1.0}, {2, 1.0}}};
  const Redundancy both = find({legs, level});
  EXPECT_EQ(both.num_couplings, 2);
  EXPECT_EQ(both.rows, 7);
  EXPECT_EQ(both.rank, 4);
  EXPECT_EQ(Count(both.released), 3);
  EXPECT_EQ(both.couplings, (std::vector<std::string>{"legs", "level"}));

  // angles of a start beyond a turn
  d.initial.coordinates[0].values[0] += 2 * kPi;
  const Redundancy turned = find({{"level", level.parts, 2 * kPi}});
  d.initial.coordinates[0].values[0] -= 2 * kPi;
  EXPECT_EQ(turned.rank, 4);
  EXPECT_EQ(Count(turned.released), 2);

  // one that depends on another, and one of the joint that closes the loop, are not analysed
  for (const CouplingDescription& other : {CouplingDescription{"again", {{0, 2.0}, {3, 2.0}}},
                                           CouplingDescription{"closing", {{2, 1.0}, {5, 1.0}}}}) {
    const Redundancy without = find({legs, other});
    EXPECT_EQ(without.num_couplings, 0);
    EXPECT_EQ(without.rank, 4);
    EXPECT_EQ(Count(without.released), 1);
    EXPECT_TRUE(without.couplings.empty());
  }

  // an independent one counts, and changes no choice
  d = Shipped("geared-five-bar");
  const Redundancy geared = FindRedundancy(d);
  EXPECT_EQ(geared.num_couplings, 1);
  EXPECT_EQ(geared.rows, 3);
  EXPECT_EQ(geared.rank, 3);
  EXPECT_TRUE(geared.couplings.empty());
}

TEST(RedundancyTest, AStartAtRestInItsLowestPositionMayBeSingular) {
  // the energy of the start takes it nowhere, and there the rank is not that of other positions
  MechanismDescription hanging = Shipped("parallelogram-in-space");
  hanging.initial.speeds.clear();
  hanging.initial.coordinates = {{0, {-kPi / 2}}, {1, {0.0}}, {2, {kPi}}};
  const Redundancy found = FindRedundancy(hanging);
  EXPECT_EQ(found.rank_at_start, 1);
  EXPECT_EQ(found.rank, 2);
  EXPECT_EQ(Count(found.released), 3);
}

TEST(RedundancyTest, JointsOnOnePinMayBeWrittenDifferently) {
  MechanismDescription d;
  d.name = "pin";
  d.bodies.push_back(Bar("bar", 1.0, 1.0, 1.0));
  for (const double x : {0.3, 0.1 + 0.2}) {
    const Eigen::Vector3d at(x, 0.0, 0.0);
    d.joints.push_back(Revolute("pin" + std::to_string(d.joints.size()), 0, at, 1, at));
  }
  EXPECT_EQ(FindRedundancy(d).rank, 0) << "two pins 6e-17 m apart are one";
}

TEST(RedundancyTest, AChoiceThatServesBadlyIsReplaced) {
  // self-stress of the parallel cranks is along them: a pin seen from its crank needs y
  MechanismDescription description = Shipped("three-cranks");
  for (int joint : FindRedundancy(description).cut) description.joints[joint].cut = true;
  for (const int given_up : {0, 1}) {
    description.joints[5].released = {given_up};
    const Mechanism<Planar, double> mechanism(description, Coordinates::kJoint);
    for (const double angle : {0.2, 1.4}) {
      Kinematics<Planar, double> kinematics(mechanism);
      VectorX<double> q(mechanism.num_q());
      q << angle, angle, angle, -angle;
      kinematics.UpdatePosition(q);
      SelfStress<Planar, double> stress(mechanism);
      const bool serves = stress.Factor(kinematics);
      EXPECT_TRUE(serves || given_up != 0) << angle;
      const std::vector<Released> best = stress.Choose(kinematics);
      ASSERT_EQ(best.size(), 1u);
      EXPECT_EQ(best.front().joint, 5);
      EXPECT_EQ(best.front().directions, std::vector<int>{0}) << angle;
      kinematics.Release(best);
      kinematics.UpdatePosition(q);
      EXPECT_EQ(kinematics.DirectionOf(5, 0), 1);
      EXPECT_TRUE(stress.Factor(kinematics)) << angle;
    }
  }
}

TEST(RedundancyTest, ReleasedDirectionsAreStillMeasured) {
  MechanismDescription description = Shipped("bennett");
  const Mechanism<Spatial, double> all(description, Coordinates::kJoint);
  const MechanismDescription less = Release(description, FindRedundancy(description));
  const Mechanism<Spatial, double> released(less, Coordinates::kJoint);
  VectorX<double> q(3);
  q << 1.0, -2.7, -0.9;  // open
  Kinematics<Spatial, double> a(all), b(released);
  a.UpdatePosition(q);
  b.UpdatePosition(q);
  const auto mismatch = [](const Kinematics<Spatial, double>& kinematics) {
    const JointState<Spatial, double>& state = kinematics.joints()[3];
    const int count = state.directions();
    return state.Sum(state.Along(kinematics.ConstraintMismatch(3), count), count);
  };
  EXPECT_GT(mismatch(a).norm(), 0.01);
  // exact directions differ from those of the frame by the mismatch itself
  const double size = mismatch(a).norm();
  EXPECT_LT((mismatch(a) - mismatch(b)).norm(), size * size);
  EXPECT_EQ(b.joints()[3].rows(), 2);
}

}  // namespace loopbench::redundancy_test
