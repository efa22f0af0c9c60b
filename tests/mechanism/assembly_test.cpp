// Consistent starts from partial data.
#include "mechanism/start/assembly.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>

#include "mechanism/description/library.h"
#include "mechanism/loops/tree_dynamics.h"

namespace loopbench {
namespace assembly_test {

constexpr double kEps = std::numeric_limits<double>::epsilon();

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

using Joints = Mechanism<Planar, double>;

double Mismatch(const Joints& mechanism, const VectorX<double>& q) {
  Kinematics<Planar, double> kinematics(mechanism);
  kinematics.UpdatePosition(q);
  double worst = 0.0;
  for (int index : mechanism.constraints()) {
    const JointState<Planar, double>& state = kinematics.joints()[index];
    worst = std::max(worst, state.Along(kinematics.ConstraintMismatch(index), state.rows()).norm());
  }
  return worst;
}

TEST(AssemblyTest, AFourBarIsAssembledFromGuesses) {
  const MechanismDescription d = FourBar(1.5);
  const Joints mechanism(d, Coordinates::kJoint);
  const Start<double> start = Assemble(d, mechanism);
  ASSERT_EQ(start.outcome, Outcome::kFinished) << start.message;
  EXPECT_EQ(start.q[0], -1.0) << "the held coordinate is untouched";
  EXPECT_NEAR(start.q[1], 0.841188, 1e-6);  // the mechanism's numbers, given to six digits
  EXPECT_NEAR(start.q[2], 1.757330, 1e-6);
  EXPECT_LE(Mismatch(mechanism, start.q), 64 * kEps) << "three bars, about a metre each";
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
    const Joints mechanism(d, Coordinates::kJoint);
    const Start<double> start = Assemble<Planar>(d, mechanism);
    EXPECT_EQ(start.outcome, Outcome::kInconsistentStart) << start.message;
  }
}

TEST(AssemblyTest, ConsistentDataAreLeftAsTheyAre) {
  for (int n : {3, 10, 50}) {
    const MechanismDescription d = Chain(n);
    const Joints mechanism(d, Coordinates::kJoint);
    const Start<double> start = Assemble(d, mechanism);
    ASSERT_EQ(start.outcome, Outcome::kFinished) << start.message;
    for (const JointValues& values : d.initial.coordinates) {
      EXPECT_NEAR(start.q[mechanism.joints()[values.joint].q_offset], values.values[0],
                  16 * kEps * n);
    }
  }
}

TEST(AssemblyTest, ConsistentSingularStartsAreLeftAsTheyAre) {
  MechanismDescription d = FourBar(1.0);
  d.initial.coordinates = {{0, {0.0}}, {1, {0.0}}, {2, {-std::acos(-1.0)}}};
  d.initial.speeds = {{0, {2.0}}, {1, {-2.0}}, {2, {2.0}}};
  const Joints mechanism(d, Coordinates::kJoint);
  const Start<double> start = Assemble(d, mechanism);
  ASSERT_EQ(start.outcome, Outcome::kFinished) << start.message;
  EXPECT_LE((start.u - Eigen::Vector3d(2.0, -2.0, 2.0)).norm(), 16 * kEps);
  EXPECT_LE((start.q - Eigen::Vector3d(0.0, 0.0, -std::acos(-1.0))).norm(), 16 * kEps);
}

TEST(AssemblyTest, SpeedsNotGivenFollowFromThoseGiven) {
  MechanismDescription d = FourBar(1.5);
  d.initial.speeds = {{0, {2.0}}};
  const Joints mechanism(d, Coordinates::kJoint);
  const Start<double> start = Assemble(d, mechanism);
  ASSERT_EQ(start.outcome, Outcome::kFinished) << start.message;
  EXPECT_EQ(start.u[0], 2.0);
  Kinematics<Planar, double> kinematics(mechanism);
  kinematics.UpdatePosition(start.q);
  MatrixX<double> J;
  TreeDynamics<Planar, double>(mechanism).Jacobian(kinematics, J);
  EXPECT_LE((J * start.u).norm(), 64 * kEps * start.u.norm());
  EXPECT_GT(std::abs(start.u[1]), 0.1);
}

/// Thousands of loops: nothing may be dense in their number. Guesses are off by a hundredth.
TEST(AssemblyTest, LongLaddersAreAssembledSparsely) {
  constexpr int kWindows = 5000;
  MechanismDescription d = Ladder(kWindows, 1.17, -0.7);
  for (JointValues& guess : d.initial.coordinates) guess.values[0] += 0.01 * std::sin(guess.joint);
  d.initial.speeds.resize(1);
  const Joints mechanism(d, Coordinates::kJoint);
  const Start<double> start = Assemble(d, mechanism);
  ASSERT_EQ(start.outcome, Outcome::kFinished) << start.message;
  // pins stand up to so many metres away, and three numbers of that size make up a mismatch
  EXPECT_LE(Mismatch(mechanism, start.q), 16 * kEps * kWindows);
  EXPECT_EQ(start.u[0], d.initial.speeds[0].values[0]);
  Kinematics<Planar, double> kinematics(mechanism);
  kinematics.UpdatePosition(start.q);
  kinematics.UpdateVelocity(start.u);
  double worst = 0.0;
  for (int index : mechanism.constraints()) {
    worst = std::max(worst, kinematics.ConstraintSpeed(index).head(2).cwiseAbs().maxCoeff());
  }
  EXPECT_LE(worst, 16 * kEps * kWindows);
}

/// The closure of a long chain is known as well as its angles add up, and is accepted so.
TEST(AssemblyTest, ALongChainCloses) {
  const MechanismDescription d = Chain(300000);
  const Joints mechanism(d, Coordinates::kJoint);
  const Start<double> start = Assemble(d, mechanism);
  EXPECT_EQ(start.outcome, Outcome::kFinished) << start.message;
}

/// Speeds given at joints that close loops, many at once: as if they were read off a solution.
TEST(AssemblyTest, SpeedsGivenAtCutJointsAreMet) {
  MechanismDescription d = Ladder(50, 1.17, -0.7);
  const Joints whole(d, Coordinates::kJoint);
  const Start<double> expected = Assemble(d, whole);
  Kinematics<Planar, double> kinematics(whole);
  kinematics.UpdatePosition(expected.q);
  kinematics.UpdateVelocity(expected.u);
  d.initial.speeds.clear();
  for (int index : whole.constraints()) {
    const JointState<Planar, double>& state = kinematics.joints()[index];
    d.joints[index].cut = true;
    d.initial.speeds.push_back({index, {state.H(0).dot(state.V_rel)}});
  }
  d.initial.speeds.push_back({0, {-0.7}});
  const Joints mechanism(d, Coordinates::kJoint);
  ASSERT_EQ(mechanism.constraints(), whole.constraints());
  const Start<double> start = Assemble(d, mechanism);
  ASSERT_EQ(start.outcome, Outcome::kFinished) << start.message;
  // each window's speeds follow from the last one's by some ten eps
  EXPECT_LE((start.u - expected.u).cwiseAbs().maxCoeff(), 10 * 50 * kEps);
}

TEST(AssemblyTest, AHeldCutJointIsReached) {
  MechanismDescription d = FourBar(1.5);
  const Joints mechanism(d, Coordinates::kJoint);
  Kinematics<Planar, double> kinematics(mechanism);
  kinematics.UpdatePosition(Assemble(d, mechanism).q);
  const double angle = kinematics.JointCoordinate(3) + 0.05;
  d.joints[3].cut = true;
  d.initial.coordinates.push_back({3, {angle}});
  d.initial.held = {3};
  const Joints with_held(d, Coordinates::kJoint);
  const Start<double> start = Assemble(d, with_held);
  ASSERT_EQ(start.outcome, Outcome::kFinished) << start.message;
  Kinematics<Planar, double> assembled(with_held);
  assembled.UpdatePosition(start.q);
  EXPECT_NEAR(assembled.JointCoordinate(3), angle, 64 * kEps);
  EXPECT_LE(Mismatch(with_held, start.q), 64 * kEps);
}

/// A spring acts at the angle beside the joint's guess, or beside 0, whichever joint is cut.
TEST(AssemblyTest, AnglesOfCutJointsCountFromTheirGuesses) {
  constexpr double kTurn = 2.0 * std::numbers::pi, kStiffness = 10.0;
  const MechanismDescription plain = FourBar(1.5);
  const Joints mechanism(plain, Coordinates::kJoint);
  const Start<double> at = Assemble(plain, mechanism);
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
        const Joints other(d, Coordinates::kJoint);
        const Start<double> start = Assemble(d, other);
        ASSERT_EQ(start.outcome, Outcome::kFinished) << start.message;
        Kinematics<Planar, double> kinematics(other);
        kinematics.UpdatePosition(start.q);
        kinematics.UpdateVelocity(start.u);
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
  const Start<double> start = Assemble(d, Joints(d, Coordinates::kJoint));
  EXPECT_EQ(start.outcome, Outcome::kInconsistentStart);
  EXPECT_NE(start.message.find("\"OC\""), std::string::npos) << start.message;
  EXPECT_NE(start.message.find("four-bar"), std::string::npos) << start.message;
  const double gap = std::hypot(10.0 - std::cos(1.0), std::sin(1.0)) - 2.0;
  EXPECT_GT(start.position_residual, 0.9 * gap);
  EXPECT_LE(start.position_residual, 1.1 * gap);
  char residual[32];
  std::snprintf(residual, sizeof residual, "%.3g", start.position_residual);
  EXPECT_NE(start.message.find(residual), std::string::npos) << start.message;
}

bool Contains(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

TEST(AssemblyTest, ARodThatIsTooLongIsNamedBesideTheJointsThatItPullsApart) {
  // two four-bars side by side; a rod of 5 m between points of the first, which are 3 m apart at
  // most. Least squares leave a part of the gap to the pin that closes the loop.
  MechanismDescription d = FourBar(1.5);
  const MechanismDescription other = FourBar(1.4);
  for (int i = 1; i <= 3; ++i) d.bodies.push_back(other.bodies[i]);
  for (JointDescription joint : other.joints) {
    joint.name = "2" + joint.name;
    for (JointSide* side : {&joint.from, &joint.to}) {
      if (side->body != kGround) side->body += 3;
    }
    d.joints.push_back(joint);
  }
  JointDescription rod;
  rod.name = "R";
  rod.type = JointType::kRod;
  rod.from = {kGround, {-0.5, 0.0, 0.0}, {0.0, 0.0, 0.0}};
  rod.to = {2, {0.5, 0.0, 0.0}, {0.0, 0.0, 0.0}};
  rod.parameter = 5.0;
  d.joints.push_back(rod);
  const Start<double> start = Assemble(d, Joints(d, Coordinates::kJoint));
  ASSERT_EQ(start.outcome, Outcome::kInconsistentStart);
  EXPECT_TRUE(Contains(start.message, "closed by rod \"R\" (length 5 m) and joint \"OC\" do not"))
      << start.message;
  EXPECT_TRUE(Contains(start.message, " m and ")) << start.message;
  EXPECT_TRUE(Contains(start.message, "held in it: \"OA\"")) << start.message;
  EXPECT_FALSE(Contains(start.message, "\"2O")) << "a loop that closes: " << start.message;
  EXPECT_FALSE(Contains(start.message, "rad")) << start.message;
}

TEST(AssemblyTest, MotionsThatExcludeEachOtherAreNamed) {
  MechanismDescription d = FourBar(1.5);
  d.initial.held.clear();
  std::erase_if(d.initial.coordinates, [](const JointValues& one) { return one.joint != 1; });
  d.joints[0].motions = {{0, Polynomial{{-1.0}}}};
  d.joints[2].motions = {{0, Polynomial{{0.1}}}};  // 1.757 fits
  const Start<double> start = Assemble(d, Joints(d, Coordinates::kJoint));
  ASSERT_EQ(start.outcome, Outcome::kInconsistentStart);
  EXPECT_TRUE(Contains(start.message, "prescribed in it: \"OA\" and \"BC\"")) << start.message;
  EXPECT_TRUE(Contains(start.message, " m; prescribed")) << start.message;
}

TEST(AssemblyTest, SpeedsThatTheLoopForbidsAreRefused) {
  MechanismDescription d = FourBar(1.5);
  d.initial.speeds = {{0, {1.0}}, {1, {1.0}}, {2, {1.0}}};
  const Start<double> start = Assemble(d, Joints(d, Coordinates::kJoint));
  EXPECT_EQ(start.outcome, Outcome::kInconsistentStart);
  EXPECT_NE(start.message.find("speeds"), std::string::npos) << start.message;
  EXPECT_TRUE(Contains(start.message, " m/s; speeds given in it: \"OA\", \"AB\" and \"BC\""))
      << start.message;
}

TEST(AssemblyTest, AbsoluteCoordinatesStartFromTheSamePose) {
  MechanismDescription d = FourBar(1.5);
  d.initial.speeds = {{0, {2.0}}};
  const Joints joint(d, Coordinates::kJoint), absolute(d, Coordinates::kAbsolute);
  const Start<double> a = Assemble(d, joint), b = Assemble(d, absolute);
  ASSERT_EQ(b.outcome, Outcome::kFinished) << b.message;
  Kinematics<Planar, double> at_a(joint), at_b(absolute);
  at_a.UpdatePosition(a.q);
  at_a.UpdateVelocity(a.u);
  at_b.UpdatePosition(b.q);
  at_b.UpdateVelocity(b.u);
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

}  // namespace assembly_test
}  // namespace loopbench
