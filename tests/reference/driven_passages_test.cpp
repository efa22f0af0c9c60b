// Prescribed motions through singular configurations: branches by closed forms, and the endings
// where no branch is determined.
#include "mechanism/description/library.h"
#include "mechanism/description/transforms.h"
#include "tests/reference/cases.h"
#include "tests/reference/simulate.h"

namespace loopbench::harness::reference::driven_passages_test {

const Eigen::Vector3d kZero = Eigen::Vector3d::Zero();

/// A mechanism with the exact angles of some of its bodies.
struct Known {
  MechanismDescription description;
  std::vector<std::pair<std::string, std::function<double(double)>>> angles;
};

MechanismFile FileOf(const MechanismDescription& description) {
  MechanismFile file;
  file.description = description;
  return file;
}

double LargestError(const Known& known, const Snapshot& at) {
  double worst = 0.0;
  for (const auto& [body, angle] : known.angles) {
    const double miss = AngleOf(at.bodies[BodyNamed(known.description, body)]) - angle(at.t);
    worst = std::max(worst, std::abs(std::remainder(miss, 2 * kPi)));
  }
  return worst;
}

/// Crank of 1 and rocker of 1 on pivots 2 apart, with a coupler of 2. The joint `driven` of the
/// crank (0), the coupler on it (1) or the rocker (2) has the motion.
MechanismDescription FourBar(double crank, double rocker, int driven,
                             const TimeFunctionDescription& motion) {
  MechanismDescription d;
  d.name = "driven-passage";
  d.gravity = {0.0, -9.81, 0.0};
  d.bodies.push_back(Bar("crank", 1.0, 1.0, 1.0 / 12));
  d.bodies.push_back(Bar("coupler", 2.0, 1.0, 1.0 / 3));
  d.bodies.push_back(Bar("rocker", 1.0, 1.0, 1.0 / 12));
  const Eigen::Vector3d x = Eigen::Vector3d::UnitX();
  d.joints = {Revolute("O", kGround, kZero, 1, kZero), Revolute("A", 1, x, 2, kZero),
              Revolute("C", kGround, 2 * x, 3, kZero), Revolute("B", 2, 2 * x, 3, x)};
  d.joints[3].cut = true;
  const double coupler =
      std::atan2(std::sin(rocker) - std::sin(crank), 2.0 + std::cos(rocker) - std::cos(crank));
  const double angles[] = {crank, coupler - crank, rocker};
  for (int joint = 0; joint < 3; ++joint) {
    if (joint != driven) d.initial.coordinates.push_back({joint, {angles[joint]}});
  }
  d.joints[static_cast<std::size_t>(driven)].motions = {{0, motion}};
  return d;
}

Known Parallelogram(const TimeFunctionDescription& motion) {
  const TimeFunction s(motion);
  const double start = s.At(0.0).value;
  return {FourBar(start, start, 0, motion), {{"rocker", [s](double t) { return s.At(t).value; }}}};
}

/// Bars that cross: tan(rocker / 2) = -3 tan(crank / 2).
Known AntiParallelogram(double start, double speed) {
  const auto rocker = [start, speed](double t) {
    const double half = (start + speed * t) / 2;
    return -2 * std::atan2(3 * std::sin(half), std::cos(half));
  };
  return {FourBar(start, rocker(0.0), 0, Polynomial{{start, speed}}), {{"rocker", rocker}}};
}

/// Crank and connecting rod of 1: a slider at 2 cos(a) has the crank at a. In line at 0 and pi, and
/// folded, with the crank free, at pi / 2.
Known SliderCrank(double start, double speed) {
  MechanismDescription d;
  d.name = "driven-slider";
  d.gravity = {0.0, -9.81, 0.0};
  d.bodies.push_back(Bar("crank", 1.0, 1.0, 1.0 / 12));
  d.bodies.push_back(Bar("rod", 1.0, 2.0, 1.0 / 6));
  d.bodies.push_back(Bar("slider", 1.0, 1.0, 0.1));
  const Eigen::Vector3d x = Eigen::Vector3d::UnitX();
  JointDescription slide = Revolute("S", kGround, kZero, 3, kZero);
  slide.type = JointType::kPrismatic;
  slide.motions = {{0, Harmonic{.amplitude = 2.0, .omega = speed, .phase = start + kPi / 2}}};
  d.joints = {Revolute("O", kGround, kZero, 1, kZero), Revolute("A", 1, x, 2, kZero), slide,
              Revolute("P", 2, x, 3, kZero)};
  d.joints[3].cut = true;
  d.initial.coordinates = {{0, {start}}, {1, {-2 * start}}};
  return {d, {{"crank", [=](double t) { return start + speed * t; }}}};
}

/// Two windows, of which the crank in the middle is driven.
Known TwoWindows(double start, double speed) {
  MechanismDescription d = Ladder(2, start, 0.0);
  d.initial.speeds.clear();
  d.initial.held.clear();
  for (JointDescription& joint : d.joints) {
    const std::string& body = d.bodies[static_cast<std::size_t>(joint.to.body)].name;
    if (joint.from.body == kGround && body == "crank1") {
      joint.motions = {{0, Polynomial{{start, speed}}}};
    }
  }
  const auto angle = [=](double t) { return start + speed * t; };
  return {d, {{"crank0", angle}, {"crank2", angle}}};
}

class DrivenPassage : public testing::TestWithParam<Method> {};

TEST_P(DrivenPassage, KeepsTheBranchAtLevelPosition) {
  Known heavy = Parallelogram(Polynomial{{0.4, 2.0}});
  heavy.description.bodies[2].mass = 300.0;
  heavy.description.bodies[3].mass = 1e-3;
  const Known coupler{FourBar(0.6, 0.6, 1, Polynomial{{-0.6, 1.3}}),
                      {{"crank", [](double t) { return 0.6 - 1.3 * t; }}}};
  // each is in line twice a turn at least
  for (const Known& known : {Parallelogram(Polynomial{{0.5, -1.0}}), heavy, coupler,
                             Parallelogram(Harmonic{.mean = 0.3, .amplitude = 2.5, .omega = 2.0}),
                             AntiParallelogram(0.7, 1.5), SliderCrank(0.5, 1.0),
                             SliderCrank(-0.4, -2.5), TwoWindows(0.8, 1.2)}) {
    for (const double tolerance : {1e-6, 1e-9}) {
      double worst = 0.0;
      const Simulation run =
          Simulate(known.description, GetParam(), Options("dormand-prince", tolerance), 8.0,
                   [&](const Snapshot& at) { worst = std::max(worst, LargestError(known, at)); });
      ASSERT_EQ(run.result.outcome, Outcome::kFinished) << known.description.name;
      ASSERT_EQ(run.last.t, 8.0);
      // closed loops have the drive's angle up to round-off, except in the width of
      // regularization, where steps leave errors of the tolerance magnified by one over a speed of
      // 0.1 or more, and regularization some 4e-6 of its own, whatever the tolerance
      EXPECT_LE(worst, 1e3 * tolerance + 1e-5) << known.description.name << " " << tolerance;
    }
  }
}

/// Redundant constraints have no range of their own: three of a planar loop in space.
TEST_P(DrivenPassage, KeepsTheBranchInSpace) {
  const Known flat = Parallelogram(Polynomial{{0.5, 1.0}});
  const Eigen::Matrix3d R = AnyRotation();
  MechanismDescription tilted = InSpace(flat.description, AnyTurn());
  double worst = 0.0;
  const Simulation run =
      Simulate(tilted, GetParam(), Options("dormand-prince", 1e-8), 8.0, [&](const Snapshot& at) {
        // in the axes of the plane
        worst = std::max(worst, (R.transpose() * (at.bodies[1].R - at.bodies[3].R) * R).norm());
      });
  ASSERT_EQ(run.result.outcome, Outcome::kFinished) << run.result.message;
  EXPECT_LE(worst, 1e-5);
}

/// At rest in line, or so slowly through it that forces outweigh inertia, no branch is determined.
TEST_P(DrivenPassage, TooSlowOnesEndWithTheReason) {
  const auto run = [&](const TimeFunctionDescription& motion) {
    return RunFile(FileOf(Parallelogram(motion).description), GetParam(), 1e-8, 6.0);
  };
  const TimeTable dwell{.times = {0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0},
                        .values = {1.0, 2.0, 3.0, kPi, kPi, kPi, 3.3}};
  for (const Record& record : {run(dwell), run(Polynomial{{kPi - 0.02, 0.01}})}) {
    const std::string message = record.Text("message");
    EXPECT_EQ(record.Text("outcome"), "singular") << message;
    EXPECT_NE(message.find("speed too low"), std::string::npos) << message;
  }
  const Record from_rest = run(Polynomial{{0.0, 0.0, 0.5}});
  EXPECT_EQ(from_rest.Text("outcome"), "inconsistent-motion");
  EXPECT_NE(from_rest.Text("message").find("start in a singular configuration"), std::string::npos)
      << from_rest.Text("message");
}

/// In line at the start, with and without the speed of the branch.
TEST_P(DrivenPassage, StartsInLineNeedTheirSpeeds) {
  Known known = Parallelogram(Polynomial{{0.0, 1.0}});
  const Record without = RunFile(FileOf(known.description), GetParam(), 1e-8, 5.0);
  EXPECT_EQ(without.Text("outcome"), "singular");
  EXPECT_LE(without.Number("t_reached"), 1e-3) << "in its first step";
  EXPECT_NE(without.Text("message").find("speeds of its branch"), std::string::npos);
  known.description.initial.speeds = {{1, {-1.0}}, {2, {1.0}}};
  const Simulation with =
      Simulate(known.description, GetParam(), Options("dormand-prince", 1e-8), 5.0, {});
  ASSERT_EQ(with.result.outcome, Outcome::kFinished);
  EXPECT_LE(LargestError(known, with.last), 1e-5);
}

/// The loop of configs/experiments/extremes/endings.json: 2.2 from the crank's end to the rocker's
/// pivot are the most, reached when the crank is at acos((0.4^2 + 1.9^2 - 2.2^2) / (2 0.4 1.9)).
void ExpectDeadEnd(const Method& method, double tolerance) {
  MechanismDescription d = FourBar(0.5, 1.5, 0, Polynomial{{0.5, 3.0}});
  d.joints[1].from.position.x() = 0.4;
  d.joints[2].from.position.x() = 1.9;
  d.joints[3].from.position.x() = 1.2;
  d.initial.coordinates = {{1, {0.2}}, {2, {1.5}}};
  const double end = (std::acos((0.16 + 3.61 - 4.84) / (2 * 0.4 * 1.9)) - 0.5) / 3.0;
  const Record record = RunFile(FileOf(d), method, tolerance, 5.0);
  EXPECT_EQ(record.Text("outcome"), "singular") << ToString(method) << record.Text("message");
  EXPECT_NEAR(record.Number("t_reached"), end, 1e-6) << ToString(method);
  EXPECT_NE(record.Text("message").find("dead end"), std::string::npos) << ToString(method);
}

TEST_P(DrivenPassage, DeadEndsAreNone) {
  for (const double tolerance : {1e-5, 1e-8}) ExpectDeadEnd(GetParam(), tolerance);
}

INSTANTIATE_TEST_SUITE_P(Methods, DrivenPassage, testing::ValuesIn(PositionMethods()),
                         NameOfParam());

std::vector<Method> MethodsBelowPosition() {
  return MethodsAt({Enforcement::kAcceleration, Enforcement::kVelocity});
}

TEST(DrivenPassageBelowPosition, DeadEndsHaveOneOutcome) {
  for (const Method& method : MethodsBelowPosition()) ExpectDeadEnd(method, 1e-8);
}

/// Below level projection a passage ends on its branch or with a name and the cure.
TEST(DrivenPassageBelowPosition, IsRightOrNamed) {
  int named = 0;
  for (const Method& method : MethodsBelowPosition()) {
    for (const Known& known : {Parallelogram(Polynomial{{0.5, 1.0}}), AntiParallelogram(0.7, 1.5),
                               SliderCrank(-0.4, -2.5)}) {
      const Record record = RunFile(FileOf(known.description), method, 1e-8, 8.0);
      if (record.Text("outcome") == "finished") {
        const Simulation run = Simulate(known.description, method, Options("ode45", 1e-8), 8.0);
        EXPECT_LE(LargestError(known, run.last), 1e-3) << ToString(method);
        continue;
      }
      ++named;
      const std::string message = record.Text("message");
      EXPECT_NE(message.find("singular configuration"), std::string::npos) << message;
      EXPECT_NE(message.find("level projection"), std::string::npos) << message;
    }
  }
  EXPECT_GT(named, 0) << "nothing was tested";
}

}  // namespace loopbench::harness::reference::driven_passages_test
