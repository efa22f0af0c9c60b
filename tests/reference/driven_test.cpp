// Prescribed motions: what is known of driven mechanisms beforehand, and motions that cannot be.
#include "mechanism/description/library.h"
#include "mechanism/formulation/system.h"
#include "mechanism/simplify/redundancy.h"
#include "mechanism/start/assembly.h"
#include "odca/odca.h"
#include "tests/reference/cases.h"
#include "tests/reference/simulate.h"

namespace loopbench::harness::reference::driven_test {

constexpr double kRtol = 1e-9;

IntegratorOptions Tight() { return Options("dormand-prince", kRtol); }

const Eigen::Vector3d kZero = Eigen::Vector3d::Zero();

/// A hinge at the origins of both bodies.
JointDescription Hinge(const std::string& name, int from, int to) {
  return Revolute(name, from, kZero, to, kZero);
}

JointDescription Slide(int to) {
  JointDescription slide = Hinge("slide", kGround, to);
  slide.type = JointType::kPrismatic;
  return slide;
}

JointDescription Moved(JointDescription joint, const TimeFunctionDescription& motion) {
  joint.motions = {{0, motion}};
  return joint;
}

MechanismDescription WithBars(const std::string& name, const std::vector<BodyDescription>& bars) {
  MechanismDescription d;
  d.name = name;
  d.bodies.insert(d.bodies.end(), bars.begin(), bars.end());
  return d;
}

class Driven : public testing::TestWithParam<Method> {};

/// Rocker angle of configs/mechanisms/driven-four-bar.json for a crank angle: where the circle of
/// the coupler about B meets that of the rocker about C, on the left of BC.
double RockerAngle(double crank) {
  const Eigen::Vector2d B(0.4 * std::cos(crank), 0.4 * std::sin(crank)), C(1.0, 0.0);
  const double d = (C - B).norm(), along = (1.2 * 1.2 - 1.0 + d * d) / (2 * d);
  const Eigen::Vector2d e = (C - B) / d, n(-e.y(), e.x());
  const Eigen::Vector2d from_C = B + along * e + std::sqrt(1.44 - along * along) * n - C;
  return std::atan2(from_C.y(), from_C.x());
}

TEST_P(Driven, CrankRockerFollowsItsGeometry) {
  const MechanismDescription description = Shipped("driven-four-bar").description;
  double worst = 0.0;
  const Simulation run = Simulate(description, GetParam(), Tight(), 10.0, [&](const Snapshot& at) {
    const double crank = 0.5 + 3.0 * at.t;
    const double rocker = AngleOf(at.bodies[BodyNamed(description, "rocker")]);
    worst = std::max(worst, std::abs(std::remainder(rocker - RockerAngle(crank), 2 * M_PI)));
    const double miss = AngleOf(at.bodies[BodyNamed(description, "crank")]) - crank;
    worst = std::max(worst, std::abs(std::remainder(miss, 2 * M_PI)));
  });
  ASSERT_EQ(run.result.outcome, Outcome::kFinished) << run.result.message;
  // errors of rtol per step, some 500 steps, and of speeds over 10 s at acceleration level
  EXPECT_LE(worst, 1e4 * kRtol);
  EXPECT_LE(run.energy_error, 1e4 * kRtol) << "of some 10 J";
}

TEST_P(Driven, DriftHoldsWhatTheDriveMisses) {
  const Record record = RunFile(Shipped("driven-four-bar"), GetParam(), kRtol, 5.0);
  ASSERT_EQ(record.Text("outcome"), "finished");
  EXPECT_GT(record.Number("energy_supplied"), 0.0) << "the damper takes it";
  // in absolute coordinates q - s(t) is a rotation that drifts; in joint ones there is none
  const bool absolute = GetParam().coordinates == Coordinates::kAbsolute;
  EXPECT_EQ(record.Number("drift_rotation_max") > 0.0, absolute);
  EXPECT_LE(record.Number("drift_rotation_max"), 1e4 * kRtol);
}

TEST_P(Driven, ScrewJackLiftsByItsTorque) {
  const MechanismDescription description = Shipped("screw-jack").description;
  // Multipliers share what redundant constraints contradict each other by among all joints of the
  // loop; these then come apart as exp(speed t) in absolute coordinates
  // (docs/theory/constraints-and-drift.md), 30 rad/s and more from 1 s on.
  const bool comes_apart =
      GetParam().formulation == "lagrange" && GetParam().coordinates == Coordinates::kAbsolute;
  const double after = comes_apart ? 0.0 : 2.0;  // [s] beyond the first
  const Simulation run = Simulate(description, GetParam(), Tight(), 1.0 + after);
  ASSERT_EQ(run.result.outcome, Outcome::kFinished) << run.result.message;
  // torque 2 + 4 t up to 1 s, 6 afterwards, less the load: integrated twice
  const double pitch = 0.005, inertia = 0.05 + 50.0 * pitch * pitch, load = 50.0 * 9.81 * pitch;
  const double speed_1 = 2.0 + 2.0 - load, angle_1 = 1.0 + 4.0 / 6.0 - load / 2;
  const double angle = (angle_1 + speed_1 * after + (6.0 - load) * after * after / 2) / inertia;
  // of 50 rad after a hundred steps or so
  const BodyState& nut = run.last.bodies[BodyNamed(description, "nut")];
  EXPECT_NEAR(nut.p.z(), pitch * angle, 1e3 * kRtol);
  EXPECT_LE(run.energy_error, 1e5 * kRtol) << "of some 300 J";
}

/// A bar that hangs from a slider with a given motion.
MechanismDescription CartPendulum(const TimeFunctionDescription& motion) {
  MechanismDescription d =
      WithBars("cart-pendulum", {Bar("cart", 1.0, 1.0, 1.0), Bar("bar", 1.0, 2.0, 0.3)});
  d.gravity = {0.0, -9.81, 0.0};
  d.joints = {Moved(Slide(1), motion), Hinge("pin", 1, 2)};
  d.initial.coordinates = {{1, {-1.0}}};
  d.initial.held = {1};
  return d;
}

/// Angle of its bar at `end` by the classical method with steps of 1e-3 s between knots: errors of
/// some 1e-12. At a knot the slider's speed may jump, and the bar's by the impulse of the pin.
double BarAngle(const TimeFunctionDescription& motion, double end) {
  const TimeFunction s(motion);
  const double mass = 2.0, arm = 0.5, inertia = 0.3 + mass * arm * arm;
  const auto rate = [&](double t, const Eigen::Vector2d& y) {
    // the pin's acceleration along x acts as gravity turned about
    const double a = s.At(t).acceleration;
    return Eigen::Vector2d(y[1],
                           mass * arm * (-9.81 * std::cos(y[0]) + a * std::sin(y[0])) / inertia);
  };
  Eigen::Vector2d y(-1.0, 0.0);
  const double h = 1e-3;
  for (int i = 0; i < std::lround(end / h); ++i) {
    const double t = i * h;
    const Eigen::Vector2d k1 = rate(t, y), k2 = rate(t + h / 2, y + h / 2 * k1),
                          k3 = rate(t + h / 2, y + h / 2 * k2), k4 = rate(t + h, y + h * k3);
    y += h / 6 * (k1 + 2 * k2 + 2 * k3 + k4);
    y[1] += mass * arm * std::sin(y[0]) * s.RateJump(t + h / 2, t + 3 * h / 2) / inertia;
  }
  return y[0];
}

TEST_P(Driven, BarOnAMovedSliderSwingsAsItsEquationSays) {
  const TimeTable table{.times = {0.0, 0.5, 0.8, 1.7, 2.0}, .values = {0.0, 0.3, 0.1, -0.2, 0.0}};
  TimeTable lines = table;
  lines.cubic = false;
  for (const TimeFunctionDescription& motion : std::initializer_list<TimeFunctionDescription>{
           Harmonic{.amplitude = 0.2, .omega = 6.0}, Polynomial{{0.0, 0.1, 0.4}}, table, lines}) {
    const MechanismDescription description = CartPendulum(motion);
    const Simulation run = Simulate(description, GetParam(), Tight(), 2.0);
    ASSERT_EQ(run.result.outcome, Outcome::kFinished) << run.result.message;
    const double angle = AngleOf(run.last.bodies[2]);
    EXPECT_NEAR(std::remainder(angle - BarAngle(motion, 2.0), 2 * M_PI), 0.0, 1e3 * kRtol);
    EXPECT_LE(run.energy_error, 1e4 * kRtol);
  }
}

/// A bar driven from rest to a speed of 1, and in line with it a second one that swings freely: the
/// impulse of the pin between them makes the moment about it 0 = m c (l + c w) + I w.
TEST_P(Driven, AJumpOfSpeedActsByImpulses) {
  MechanismDescription d =
      WithBars("kink", {Bar("driven", 1.0, 1.0, 0.1), Bar("free", 1.0, 1.0, 0.1)});
  const TimeTable kink{.times = {0.2, 5.0}, .values = {0.0, 4.8}, .cubic = false};
  d.joints = {Moved(Hinge("drive", kGround, 1), kink),
              Revolute("pin", 1, {1.0, 0.0, 0.0}, 2, kZero)};
  d.initial.coordinates = {{1, {0.0}}};
  double speed = 0.0;
  const Simulation run = Simulate(d, GetParam(), Tight(), 0.2 + 1e-9,
                                  [&](const Snapshot& at) { speed = at.bodies[2].w.z(); });
  ASSERT_EQ(run.result.outcome, Outcome::kFinished) << run.result.message;
  EXPECT_NEAR(speed, -0.5 / (0.25 + 0.1), 1e3 * kRtol);
  EXPECT_LE(run.energy_error, 1e4 * kRtol) << "the drive supplies the work of the impulse";
  const Experiment experiment = Single({.description = d, .observe = {}, .canonical = ""});
  const Record record = RunCase(experiment, CaseOf(experiment, d.name, GetParam(), kRtol, 0.4));
  EXPECT_LE(record.Number("energy_error_max"), 1e4 * kRtol) << "as runs count it";
}

/// Without a state, positions follow from the time alone, also if the last stage had another time.
TEST(DrivenWithoutState, AcceptedStepsHaveTheirOwnTime) {
  MechanismDescription d = WithBars("turned", {Bar("bar", 1.0, 1.0, 0.1)});
  d.joints = {Moved(Hinge("drive", kGround, 1), Polynomial{{0.0, 1.0}})};
  const Mechanism<Planar, double> mechanism(d, Coordinates::kJoint);
  const auto system = MakeSystem<odca::Odca>(mechanism);
  std::array<double, 2> y = {}, ydot = {};
  ASSERT_EQ(system->Start(0.0, VectorX<double>(), VectorX<double>()), Outcome::kFinished);
  ASSERT_EQ(system->Derivative(0.5, y, ydot), Outcome::kFinished);
  system->BeginStep(1.0, y);
  EXPECT_EQ(system->kinematics().poses()[1].angle, 1.0);
}

/// A slider-crank whose crank has two hinges on Ground; the one that is cut is driven.
TEST_P(Driven, ARedundantHingeMayBeDriven) {
  MechanismDescription d = WithBars(
      "two-hinges",
      {Bar("crank", 1.0, 1.0, 0.1), Bar("rod", 2.0, 1.0, 0.1), Bar("slider", 0.0, 1.0, 0.1)});
  d.joints = {Hinge("first", kGround, 1), Revolute("knee", 1, {1.0, 0.0, 0.0}, 2, kZero), Slide(3),
              Revolute("end", 2, {2.0, 0.0, 0.0}, 3, kZero),
              Moved(Hinge("second", kGround, 1), Polynomial{{0.5, 1.0}})};
  d.joints[3].cut = d.joints[4].cut = true;
  d.initial.coordinates = {{0, {0.5}}, {1, {-0.7}}, {2, {2.7}}};
  const Redundancy redundancy = FindRedundancy(d);
  ASSERT_EQ(redundancy.released.size(), 1u);
  EXPECT_EQ(redundancy.released[0].joint, 4);
  EXPECT_EQ(redundancy.released[0].directions, (std::vector<int>{0, 1}));
  double worst = 0.0;
  const Simulation run =
      Simulate(Release(d, redundancy), GetParam(), Tight(), 2.0, [&](const Snapshot& at) {
        const double crank = 0.5 + at.t, across = 0.5 * std::sin(crank);
        const double x = std::cos(crank) + 2.0 * std::sqrt(1.0 - across * across);
        worst = std::max(worst, std::abs(at.bodies[3].p.x() - x));
      });
  ASSERT_EQ(run.result.outcome, Outcome::kFinished) << run.result.message;
  EXPECT_LE(worst, 1e4 * kRtol);
}

/// Both cranks of a parallelogram driven: consistent, or not.
MechanismDescription TwoDrives(const Polynomial& first, const Polynomial& second) {
  MechanismDescription d = Ladder(1, 1.0, 0.0);
  d.initial = {};
  for (JointDescription& joint : d.joints) {
    if (joint.from.body != kGround) continue;
    joint.motions = {{0, d.joints[0].motions.empty() ? first : second}};
  }
  d.name = "two-drives";
  return d;
}

TEST_P(Driven, TwoDrivesMustAgree) {
  const auto outcome = [&](const Polynomial& first, const Polynomial& second) {
    return Simulate(TwoDrives(first, second), GetParam(), Tight(), 1.0).result.outcome;
  };
  EXPECT_EQ(outcome({{1.0, 0.5}}, {{1.0, 0.5}}), Outcome::kFinished) << "redundant, but consistent";
  EXPECT_EQ(outcome({{1.0, 0.5}}, {{1.2, 0.5}}), Outcome::kInconsistentStart) << "positions";
  EXPECT_EQ(outcome({{1.0, 0.5}}, {{1.0, 0.6}}), Outcome::kInconsistentStart) << "speeds";
  EXPECT_EQ(outcome({{1.0, 0.5}}, {{1.0, 0.5, 0.1}}), Outcome::kInconsistentMotion);
}

TEST_P(Driven, TriangleIsLocked) {
  MechanismDescription d =
      WithBars("triangle", {Bar("left", 1.0, 1.0, 0.1), Bar("right", 1.0, 1.0, 0.1)});
  const Eigen::Vector3d tip(1.0, 0.0, 0.0), C(1.0, 0.0, 0.0);
  d.joints = {Hinge("O", kGround, 1), Revolute("C", kGround, C, 2, kZero),
              Revolute("T", 1, tip, 2, tip)};
  d.initial.coordinates = {{0, {1.0}}, {1, {2.0}}};
  const Simulation run = Simulate(d, GetParam(), Tight(), 1.0);
  EXPECT_EQ(run.result.outcome, Outcome::kLocked);
  EXPECT_NE(run.result.message.find("nothing can move"), std::string::npos);
}

TEST_P(Driven, ArmWithAllJointsDrivenHasNothingToIntegrate) {
  MechanismDescription d = CartPendulum(Harmonic{.amplitude = 0.2, .omega = 6.0});
  d.joints[1].motions = {{0, Polynomial{{-1.0, 2.0}}}};
  d.initial = {};
  const Simulation run = Simulate(d, GetParam(), Tight(), 2.0);
  ASSERT_EQ(run.result.outcome, Outcome::kFinished) << run.result.message;
  const BodyState& bar = run.last.bodies[2];
  EXPECT_NEAR(bar.p.x(), 0.2 * std::sin(12.0) + 0.5 * std::cos(3.0), 1e4 * kRtol);
  EXPECT_LE(run.energy_error, 1e4 * kRtol);
}

template <class Test>
void AtAllLevels(Method method, const Test& test) {
  for (const Enforcement level :
       {Enforcement::kAcceleration, Enforcement::kVelocity, Enforcement::kPosition}) {
    method.enforcement = level;
    test(method);
  }
}

/// Nothing accelerates, no force acts: discs about one axis with their centres of mass on it, and a
/// rod between them.
TEST_P(Driven, DiscsTurnTogether) {
  MechanismDescription d = WithBars("discs", {Bar("a", 1.0, 1.0, 0.1), Bar("b", 1.0, 2.0, 0.3)});
  for (BodyDescription& body : d.bodies) body.com.setZero();
  const Eigen::Vector3d on_a(0.2, 0.1, 0.0), on_b(-0.1, 0.4, 0.0);
  JointDescription rod = Revolute("R", 1, on_a, 2, on_b);
  rod.type = JointType::kRod;
  rod.parameter = (on_a - on_b).norm();
  d.joints = {Hinge("O", kGround, 1), Hinge("Q", kGround, 2), rod};
  for (const double speed : {-40.0, 0.07}) {
    d.joints[0].motions = {{0, Polynomial{{0.0, speed}}}};
    AtAllLevels(GetParam(), [&](const Method& method) {
      const Simulation run = Simulate(d, method, Tight(), 3.0);
      ASSERT_EQ(run.result.outcome, Outcome::kFinished) << ToString(method);
      EXPECT_NEAR(run.last.bodies[2].w.z() / speed, 1.0, 1e-7) << ToString(method);
      const double miss = AngleOf(run.last.bodies[2]) - 3.0 * speed;
      EXPECT_NEAR(std::remainder(miss, 2 * M_PI), 0.0, 1e-6) << ToString(method);
    });
  }
}

/// Cardan's joint between shafts at an angle b: speeds in the ratio cos b / (1 - sin^2 b cos^2 a)
/// where the driving fork has turned by a out of the plane of the shafts.
TEST_P(Driven, CardansJointHasItsLaw) {
  for (const double b : {0.3, -0.9}) {
    const Eigen::Vector3d axis(std::cos(b), std::sin(b), 0.0);
    MechanismDescription d;
    d.name = "cardan";
    d.space = SpaceKind::kSpatial;
    for (const double sign : {-1.0, 1.0}) {
      BodyDescription shaft = Bar(sign < 0.0 ? "in" : "out", 1.0, 1.0, 0.02);
      shaft.com = {0.2 * sign, 0.0, 0.0};
      shaft.inertia = Eigen::Vector3d(0.01, 0.02, 0.02).asDiagonal();
      d.bodies.push_back(shaft);
    }
    const Eigen::Vector3d along_x = Eigen::Vector3d::UnitX();
    JointDescription in = Revolute("in", kGround, -0.4 * along_x, 1, -0.4 * along_x);
    JointDescription out = Revolute("out", kGround, 0.4 * axis, 2, 0.4 * along_x);
    in.axis = out.axis = along_x;
    in.motions = {{0, Polynomial{{0.0, 5.0}}}};
    out.from.rotation = {0.0, 0.0, b};
    out.cut = true;
    JointDescription fork = Hinge("U", 1, 2);
    fork.type = JointType::kUniversal;
    // x to y, y to z: the first axis is the driving shaft's y, the second the other's z
    fork.from.rotation = fork.to.rotation =
        Eigen::Vector3d::Constant(2 * M_PI / 3 / std::sqrt(3.0));
    d.joints = {in, fork, out};
    d.initial.coordinates = {{1, {0.0, b}}};
    AtAllLevels(GetParam(), [&](const Method& method) {
      double worst = 0.0;
      const Simulation run = Simulate(d, method, Tight(), 2.0, [&](const Snapshot& at) {
        const double law =
            5.0 * std::cos(b) / (1.0 - std::pow(std::sin(b) * std::cos(5.0 * at.t), 2));
        worst = std::max(worst, std::abs(std::abs(at.bodies[2].w.dot(axis)) - law));
      });
      ASSERT_EQ(run.result.outcome, Outcome::kFinished) << ToString(method);
      EXPECT_LE(worst, 1e-5) << ToString(method);
    });
  }
}

INSTANTIATE_TEST_SUITE_P(Methods, Driven, testing::ValuesIn(RankRevealingMethods()), NameOfParam());

}  // namespace loopbench::harness::reference::driven_test
