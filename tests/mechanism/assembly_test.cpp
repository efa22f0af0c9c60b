// Consistent starts from partial data.
#include "mechanism/loops/tree_dynamics.h"
#include "tests/mechanism/shipped.h"

namespace loopbench::assembly_test {

/// The paper's four-bar with its pins `ground` apart; crank at -1 rad, the others guessed.
MechanismDescription FourBar(double ground) {
  const Eigen::Vector3d origin = Eigen::Vector3d::Zero(), tip = Eigen::Vector3d::UnitX();
  MechanismDescription d;
  d.name = "four-bar";
  d.gravity = {0.0, -9.81, 0.0};
  for (const char* name : {"bar1", "bar2", "bar3"}) d.bodies.push_back(Bar(name, 1.0, 1.0, 1.0));
  d.joints = {Revolute("OA", 0, origin, 1, origin), Revolute("AB", 1, tip, 2, origin),
              Revolute("BC", 2, tip, 3, origin), Revolute("OC", 3, tip, 0, ground * tip)};
  d.initial.coordinates = {{0, {-1.0}}, {1, {0.8}}, {2, {1.7}}};
  d.initial.held = {0};
  return d;
}

using testing::Assembled;

bool Contains(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

double Mismatch(const Assembled<>& at) {
  double worst = 0.0;
  for (int index : at.mechanism.constraints()) {
    const JointState<Planar, double>& state = at.kinematics.joints()[index];
    const auto mismatch = at.kinematics.ConstraintMismatch(index);
    worst = std::max(worst, state.Along(mismatch, state.rows()).norm());
  }
  return worst;
}

TEST(AssemblyTest, AFourBarIsAssembledFromGuesses) {
  const MechanismDescription d = FourBar(1.5);
  const Assembled<> at(d);
  const Start<double>& start = at.start;
  ASSERT_EQ(start.outcome, Outcome::kFinished) << start.message;
  EXPECT_EQ(start.q[0], -1.0) << "the held coordinate is untouched";
  EXPECT_NEAR(start.q[1], 0.841188, 1e-6);  // the mechanism's numbers, given to six digits
  EXPECT_NEAR(start.q[2], 1.757330, 1e-6);
  EXPECT_LE(Mismatch(at), 64 * kEps) << "three bars, about a metre each";
  EXPECT_LE(start.position_residual, 64 * kEps);
  EXPECT_EQ(start.u, VectorX<double>::Zero(3));
}

/// A bar welded to Ground by one joint, and hinged to it by another with a speed.
TEST(AssemblyTest, SpeedsOfWhatCannotMoveAreInconsistent) {
  const Eigen::Vector3d origin = Eigen::Vector3d::Zero();
  for (const double speed : {1.0, 1e-8}) {
    MechanismDescription d;
    d.name = "welded";
    d.bodies.push_back(Bar("bar", 1.0, 1.0, 1.0));
    d.joints = {Revolute("W", 0, origin, 1, origin), Revolute("R", 0, origin, 1, origin)};
    d.joints[0].type = JointType::kWeld;
    d.joints[1].cut = true;
    d.initial.speeds = {{1, {speed}}};
    const Start<double> start = Assembled<>(d).start;
    EXPECT_EQ(start.outcome, Outcome::kInconsistentStart) << start.message;
  }
}

TEST(AssemblyTest, ConsistentDataAreLeftAsTheyAre) {
  for (int n : {3, 10, 50}) {
    const MechanismDescription d = Chain(n);
    const Assembled<> at(d);
    ASSERT_EQ(at.start.outcome, Outcome::kFinished) << at.start.message;
    for (const JointValues& values : d.initial.coordinates) {
      EXPECT_NEAR(at.start.q[at.mechanism.joints()[values.joint].q_offset], values.values[0],
                  16 * kEps * n);
    }
  }
}

TEST(AssemblyTest, ConsistentSingularStartsAreLeftAsTheyAre) {
  MechanismDescription d = FourBar(1.0);
  d.initial.coordinates = {{0, {0.0}}, {1, {0.0}}, {2, {-std::acos(-1.0)}}};
  d.initial.speeds = {{0, {2.0}}, {1, {-2.0}}, {2, {2.0}}};
  const Assembled<> at(d);
  const Start<double>& start = at.start;
  ASSERT_EQ(start.outcome, Outcome::kFinished) << start.message;
  EXPECT_LE((start.u - Eigen::Vector3d(2.0, -2.0, 2.0)).norm(), 16 * kEps);
  EXPECT_LE((start.q - Eigen::Vector3d(0.0, 0.0, -std::acos(-1.0))).norm(), 16 * kEps);
}

TEST(AssemblyTest, SpeedsNotGivenFollowFromThoseGiven) {
  MechanismDescription d = FourBar(1.5);
  d.initial.speeds = {{0, {2.0}}};
  const Assembled<> at(d);
  const Start<double>& start = at.start;
  ASSERT_EQ(start.outcome, Outcome::kFinished) << start.message;
  EXPECT_EQ(start.u[0], 2.0);
  MatrixX<double> J;
  TreeDynamics<Planar, double>(at.mechanism).Jacobian(at.kinematics, J);
  EXPECT_LE((J * start.u).norm(), 64 * kEps * start.u.norm());
  EXPECT_GT(std::abs(start.u[1]), 0.1);
}

/// Thousands of loops: nothing may be dense in their number. Guesses are off by a hundredth.
TEST(AssemblyTest, LongLaddersAreAssembledSparsely) {
  constexpr int kWindows = 5000;
  MechanismDescription d = Ladder(kWindows, 1.17, -0.7);
  for (JointValues& guess : d.initial.coordinates) guess.values[0] += 0.01 * std::sin(guess.joint);
  d.initial.speeds.resize(1);
  const Assembled<> at(d);
  const Start<double>& start = at.start;
  ASSERT_EQ(start.outcome, Outcome::kFinished) << start.message;
  // pins stand up to so many metres away, and three numbers of that size make up a mismatch
  EXPECT_LE(Mismatch(at), 16 * kEps * kWindows);
  EXPECT_EQ(start.u[0], d.initial.speeds[0].values[0]);
  double worst = 0.0;
  for (int index : at.mechanism.constraints()) {
    worst = std::max(worst, at.kinematics.ConstraintSpeed(index).head(2).cwiseAbs().maxCoeff());
  }
  EXPECT_LE(worst, 16 * kEps * kWindows);
}

/// The closure of a long chain is known as well as its angles add up, and is accepted so.
TEST(AssemblyTest, ALongChainCloses) {
  const Start<double> start = Assembled<>(Chain(300000)).start;
  EXPECT_EQ(start.outcome, Outcome::kFinished) << start.message;
}

/// Speeds given at joints that close loops, many at once: as if they were read off a solution.
TEST(AssemblyTest, SpeedsGivenAtCutJointsAreMet) {
  MechanismDescription d = Ladder(50, 1.17, -0.7);
  const Assembled<> whole(d);
  d.initial.speeds.clear();
  for (int index : whole.mechanism.constraints()) {
    const JointState<Planar, double>& state = whole.kinematics.joints()[index];
    d.joints[index].cut = true;
    d.initial.speeds.push_back({index, {state.H(0).dot(state.V_rel)}});
  }
  d.initial.speeds.push_back({0, {-0.7}});
  const Assembled<> at(d);
  const Start<double>&start = at.start, &expected = whole.start;
  ASSERT_EQ(at.mechanism.constraints(), whole.mechanism.constraints());
  ASSERT_EQ(start.outcome, Outcome::kFinished) << start.message;
  // each window's speeds follow from the last one's by some ten eps
  EXPECT_LE((start.u - expected.u).cwiseAbs().maxCoeff(), 10 * 50 * kEps);
}

TEST(AssemblyTest, AHeldCutJointIsReached) {
  MechanismDescription d = FourBar(1.5);
  const double angle = Assembled<>(d).kinematics.JointCoordinate(3) + 0.05;
  d.joints[3].cut = true;
  d.initial.coordinates.push_back({3, {angle}});
  d.initial.held = {3};
  const Assembled<> at(d);
  ASSERT_EQ(at.start.outcome, Outcome::kFinished) << at.start.message;
  EXPECT_NEAR(at.kinematics.JointCoordinate(3), angle, 64 * kEps);
  EXPECT_LE(Mismatch(at), 64 * kEps);
}

/// A spring acts at the angle beside the joint's guess, or beside 0, whichever joint is cut.
TEST(AssemblyTest, AnglesOfCutJointsCountFromTheirGuesses) {
  constexpr double kTurn = 2.0 * kPi, kStiffness = 10.0;
  const Start<double> at = Assembled<>(FourBar(1.5)).start;
  // the loop closes in the plane: angles between its bars add up to 0
  const double angles[] = {at.q[0], at.q[1], at.q[2], -at.q.sum()};
  for (const double turns : {0.0, kTurn, -2.0 * kTurn}) {
    for (int cut = 0; cut < 4; ++cut) {
      for (int spring = 0; spring < 4; ++spring) {
        MechanismDescription d = FourBar(1.5);
        d.gravity.setZero();
        d.joints[cut].cut = true;
        d.initial.coordinates[0].values[0] += turns;
        d.initial.coordinates.push_back({3, {-1.2 - turns}});
        d.forces = {JointSpring{.joint = spring, .stiffness = kStiffness, .rest = 0.1}};
        Assembled<> other(d);
        ASSERT_EQ(other.start.outcome, Outcome::kFinished) << other.start.message;
        Kinematics<Planar, double>& kinematics = other.kinematics;
        const double wound = spring == 0 ? turns : spring == 3 ? -turns : 0.0;
        const double stretch = angles[spring] + wound - 0.1;
        for (int steps = 0; steps < 2; ++steps) {
          // 64 eps of angles of up to twenty
          EXPECT_NEAR(kinematics.JointCoordinate(spring), angles[spring] + wound, 64 * kEps * 20)
              << cut << ' ' << spring << ' ' << turns;
          EXPECT_NEAR(ComputeEnergy(kinematics).potential, 0.5 * kStiffness * stretch * stretch,
                      1e-11 * (1.0 + stretch * stretch))
              << cut << ' ' << spring << ' ' << turns;
          kinematics.AcceptStep();
        }
      }
    }
  }
}

TEST(AssemblyTest, AnUnreachableClosureNamesItsLoopAndResidual) {
  // the crank's tip is at (cos 1, -sin 1), two bars reach 2 m further, the pin is at 10 m:
  // stretched
  const MechanismDescription d = FourBar(10.0);
  const Start<double> start = Assembled<>(d).start;
  EXPECT_EQ(start.outcome, Outcome::kInconsistentStart);
  EXPECT_TRUE(Contains(start.message, "\"OC\"")) << start.message;
  EXPECT_TRUE(Contains(start.message, "four-bar")) << start.message;
  const double gap = std::hypot(10.0 - std::cos(1.0), std::sin(1.0)) - 2.0;
  EXPECT_GT(start.position_residual, 0.9 * gap);
  EXPECT_LE(start.position_residual, 1.1 * gap);
  char residual[32];
  std::snprintf(residual, sizeof residual, "%.3g", start.position_residual);
  EXPECT_TRUE(Contains(start.message, residual)) << start.message;
}

TEST(AssemblyTest, ARodThatIsTooLongIsNamedBesideTheJointsThatItPullsApart) {
  // two four-bars side by side; a rod of 5 m between points of the first, which are 3 m apart at
  // most. Least squares leave a part of the gap to the pin that closes the loop.
  MechanismDescription other = FourBar(1.4);
  other.initial = {};
  MechanismDescription d = testing::Beside(FourBar(1.5), other, "2");
  JointDescription rod;
  rod.name = "R";
  rod.type = JointType::kRod;
  rod.from = {kGround, {-0.5, 0.0, 0.0}, {0.0, 0.0, 0.0}};
  rod.to = {2, {0.5, 0.0, 0.0}, {0.0, 0.0, 0.0}};
  rod.parameter = 5.0;
  d.joints.push_back(rod);
  const Start<double> start = Assembled<>(d).start;
  ASSERT_EQ(start.outcome, Outcome::kInconsistentStart);
  EXPECT_TRUE(Contains(start.message, "closed by rod \"R\" (length 5 m) and joint \"OC\" do not"))
      << start.message;
  EXPECT_TRUE(Contains(start.message, " m and ")) << start.message;
  EXPECT_TRUE(Contains(start.message, "held in it: \"OA\"")) << start.message;
  EXPECT_FALSE(Contains(start.message, "2\"")) << "a loop that closes: " << start.message;
  EXPECT_FALSE(Contains(start.message, "rad")) << start.message;
}

TEST(AssemblyTest, MotionsThatExcludeEachOtherAreNamed) {
  MechanismDescription d = FourBar(1.5);
  d.initial.held.clear();
  std::erase_if(d.initial.coordinates, [](const JointValues& one) { return one.joint != 1; });
  d.joints[0].motions = {{0, Polynomial{{-1.0}}}};
  d.joints[2].motions = {{0, Polynomial{{0.1}}}};  // 1.757 fits
  const Start<double> start = Assembled<>(d).start;
  ASSERT_EQ(start.outcome, Outcome::kInconsistentStart);
  EXPECT_TRUE(Contains(start.message, "prescribed in it: \"OA\" and \"BC\"")) << start.message;
  EXPECT_TRUE(Contains(start.message, " m; prescribed")) << start.message;
}

TEST(AssemblyTest, SpeedsThatTheLoopForbidsAreRefused) {
  MechanismDescription d = FourBar(1.5);
  d.initial.speeds = {{0, {1.0}}, {1, {1.0}}, {2, {1.0}}};
  const Start<double> start = Assembled<>(d).start;
  EXPECT_EQ(start.outcome, Outcome::kInconsistentStart);
  EXPECT_TRUE(Contains(start.message, " m/s; speeds given in it: \"OA\", \"AB\" and \"BC\""))
      << start.message;
}

TEST(AssemblyTest, AbsoluteCoordinatesStartFromTheSamePose) {
  MechanismDescription d = FourBar(1.5);
  d.initial.speeds = {{0, {2.0}}};
  const Assembled<> joint(d), absolute(d, Coordinates::kAbsolute);
  ASSERT_EQ(absolute.start.outcome, Outcome::kFinished) << absolute.start.message;
  const Kinematics<Planar, double>&at_a = joint.kinematics, &at_b = absolute.kinematics;
  for (int body = 1; body <= 3; ++body) {
    EXPECT_LE((at_a.poses()[body].p - at_b.poses()[body].p).norm(), 16 * kEps);
    EXPECT_NEAR(at_a.poses()[body].angle, at_b.poses()[body].angle, 16 * kEps);
    EXPECT_LE((at_a.motions()[body] - at_b.motions()[body]).norm(), 64 * kEps);
  }
}

TEST(AssemblyTest, PerturbMovesHeldCoordinatesAndIsDeterministic) {
  const MechanismDescription d = FourBar(1.5);
  const MechanismDescription a = Perturb(d, 1e-3, 7, 2), b = Perturb(d, 1e-3, 7, 2);
  const double moved = a.initial.coordinates[0].values[0];
  EXPECT_EQ(moved, b.initial.coordinates[0].values[0]);
  EXPECT_NE(moved, -1.0);
  EXPECT_LE(std::abs(moved + 1.0), 1e-3);
  EXPECT_EQ(a.initial.coordinates[1].values, d.initial.coordinates[1].values);
  EXPECT_NE(moved, Perturb(d, 1e-3, 7, 3).initial.coordinates[0].values[0]);
  EXPECT_NE(moved, Perturb(d, 1e-3, 8, 2).initial.coordinates[0].values[0]);
}

}  // namespace loopbench::assembly_test
