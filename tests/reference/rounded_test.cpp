// Files with few digits: loops close within their accuracy, and what differs by less is redundant.
#include "mechanism/simplify/redundancy.h"
#include "mechanism/simplify/structure.h"
#include "mechanism/start/assembly.h"
#include "tests/reference/cases.h"
#include "tests/reference/simulate.h"

namespace loopbench::harness::reference::rounded_test {

constexpr double kQuarter = kPi / 2;

MechanismFile Rounded(const std::string& name) {
  return ReadMechanism(kRoot / "tests/reference/rounded" / (name + ".json"));
}

template <class Space>
Start<double> StartOf(const MechanismDescription& description) {
  return Assemble<Space>(description, Mechanism<Space, double>(description, Coordinates::kJoint));
}

/// A planar four-bar described in space. The crank's axis and that of the joint which closes the
/// loop stand at `angle` from z, a quarter turn in a file with enough digits.
MechanismFile FourBar(double angle) {
  const auto text = [](double a) { return std::to_string(a) + ", 0, 0"; };
  std::string rotation = text(angle);
  if (angle == kQuarter) rotation = "1.5707963267948966, 0, 0";
  return ParseMechanism(R"({
    "name": "rounded", "space": "spatial", "gravity": [0, 0, -9.81],
    "bodies": [
      {"name": "crank", "mass": 1.0, "inertia": [0.0075, 0.001, 0.0075], "com": [0, 0.15, 0]},
      {"name": "coupler", "mass": 1.5, "inertia": [0.001, 0.08, 0.08], "com": [0.4, 0, 0]},
      {"name": "rocker", "mass": 1.2, "inertia": [0.025, 0.025, 0.001], "com": [0, 0, 0.25]}],
    "joints": [
      {"name": "A", "type": "revolute", "from": {"body": "ground", "rotation": [)" +
                            rotation + R"(]},
       "to": {"body": "crank"}, "axis": [0, 0, 1]},
      {"name": "B", "type": "revolute", "from": {"body": "crank", "at": [0, 0.3, 0]},
       "to": {"body": "coupler"}, "axis": [0, 0, 1]},
      {"name": "D", "type": "revolute", "from": {"body": "ground", "at": [0.8, 0, -0.2]},
       "to": {"body": "rocker"}, "axis": [0, -1, 0]},
      {"name": "C", "type": "revolute", "from": {"body": "coupler", "at": [0.8, 0, 0]},
       "to": {"body": "rocker", "at": [0, 0, 0.5], "rotation": [)" +
                            rotation + R"(]}, "axis": [0, 0, 1], "cut": true}],
    "initial": {"coordinates": {"A": 0.3, "B": -0.2, "D": 0.2}, "fixed": ["A"]}
  })",
                        "rounded.json");
}

class Lean : public ::testing::TestWithParam<double> {};

TEST_P(Lean, IsNamedAndLeavesTheMechanismFreeToMove) {
  const MechanismFile file = FourBar(kQuarter + GetParam());
  const Redundancy found = FindRedundancy(file.description);
  EXPECT_EQ(found.rank, 2);
  ASSERT_EQ(found.released.size(), 1u);
  EXPECT_EQ(found.released[0].directions.size(), 3u);
  // within a factor that the arms of the linkage explain
  EXPECT_GT(found.rounding, 0.1 * GetParam());
  EXPECT_LT(found.rounding, 10.0 * GetParam());
}

TEST_P(Lean, ChangesAMotionByItsOwnSize) {
  const MechanismFile exact = FourBar(kQuarter), leaning = FourBar(kQuarter + GetParam());
  for (const Method& method : MethodsAt({Enforcement::kVelocity, Enforcement::kPosition})) {
    const auto end = [&](const MechanismFile& file) {
      Experiment experiment = Single(file);
      experiment.compile.planar = false;
      return RunCase(experiment, CaseOf(experiment, file.description.name, method, 1e-9, 1.0));
    };
    const Record expected = end(exact), record = end(leaning);
    EXPECT_EQ(record.Text("outcome"), "finished");
    // loops close: what lean is left over belongs to rows that are not imposed
    if (method.enforcement == Enforcement::kPosition) {
      EXPECT_LT(record.Number("drift_position_max"), 1e-13);
    }
    // some 200 steps with errors of the tolerance
    EXPECT_LT(std::abs(record.Number("energy_error_relative")), 1e-7);
    EXPECT_NEAR(record.Number("steps"), expected.Number("steps"), 5);
  }
}

INSTANTIATE_TEST_SUITE_P(Leans, Lean, ::testing::Values(3.7e-6, 1e-5),
                         [](const auto& one) { return one.param < 5e-6 ? "SixDigits" : "Most"; });

TEST(RoundedInput, AnExactLinkageStaysExact) {
  const Redundancy found = FindRedundancy(FourBar(kQuarter).description);
  EXPECT_EQ(found.rank, 2);
  EXPECT_EQ(found.rounding, 0.0);
}

TEST(RoundedInput, ALeanBeyondTheAccuracyIsNoRounding) {
  MechanismFile file = FourBar(kQuarter + 1e-4);
  EXPECT_NE(StartOf<Spatial>(file.description).outcome, Outcome::kFinished);
  // unless the file is less accurate
  file.description.accuracy = 1e-3;
  EXPECT_EQ(StartOf<Spatial>(file.description).outcome, Outcome::kFinished);
}

/// A linkage with its geometry in numbers of six decimals.
MechanismFile SixDecimals(const std::string& name) {
  MechanismFile file = Overconstrained(name);
  const auto shorten = [](Eigen::Vector3d& v) { v = (v * 1e6).array().round() / 1e6; };
  for (JointDescription& joint : file.description.joints) {
    shorten(joint.axis);
    joint.parameter = std::round(joint.parameter * 1e6) / 1e6;
    for (JointSide* side : {&joint.from, &joint.to}) {
      shorten(side->position);
      shorten(side->rotation);
    }
  }
  return file;
}

/// Self-stresses of these linkages turn, so that no fixed choice of released directions serves for
/// the whole motion: with one the joints came apart by up to 1 m.
TEST(RoundedInput, OverconstrainedLinkagesKeepTheirMotion) {
  for (const std::string name : {"goldberg-5r", "bennett-turning", "myard-5r", "schatz"}) {
    const MechanismFile exact = Overconstrained(name);
    for (const Method& method : MethodsAt({Enforcement::kPosition}, {Coordinates::kJoint})) {
      SCOPED_TRACE(name + ToString(method));
      const auto end = [&](const MechanismFile& file) {
        const MechanismDescription run_as =
            Release(file.description, FindRedundancy(file.description));
        const Simulation run = Simulate(run_as, method, Options("ode45", 1e-8), 2.0);
        EXPECT_EQ(run.result.outcome, Outcome::kFinished) << run.result.message;
        return PointOf(file.description, run.last,
                       static_cast<int>(file.description.bodies.size()) - 1,
                       Eigen::Vector3d::Zero());
      };
      // Lean of 1e-6 rad, times expansion coefficients below ten, over 18 rad of motion.
      EXPECT_LT((end(exact) - end(SixDecimals(name))).norm(), 1e-3);
    }
  }
}

/// Rounding grows near singular positions: the walk that looks for redundant rows must neither take
/// one for independent there, nor count loops as open. These linkages were rigid, or kept all rows.
TEST(RoundedInput, LinkagesThatPassNearSingularPositionsAreFreeToMove) {
  for (const char* name : {"waldron-six-digits", "waldron-other-six-digits", "waldron-five-digits",
                           "plano-spherical-five-digits"}) {
    SCOPED_TRACE(name);
    const MechanismFile file = Rounded(name);
    const Redundancy found = FindRedundancy(file.description);
    EXPECT_EQ(found.rows, 5);
    EXPECT_EQ(found.rank, 4);
    ASSERT_EQ(found.released.size(), 1u);
    EXPECT_EQ(found.released[0].directions.size(), 1u);
    const auto end = [&](const char* formulation) {
      const Method method{.formulation = formulation, .enforcement = Enforcement::kPosition};
      const Simulation run =
          Simulate(Release(file.description, found), method, Options("ode45", 1e-8), 0.5);
      EXPECT_EQ(run.result.outcome, Outcome::kFinished) << run.result.message;
      return PointOf(file.description, run.last, 1, Eigen::Vector3d::UnitX());
    };
    // within the same imposed rows they solve the same equations
    EXPECT_LT((end("odca") - end("lagrange")).norm(), 1e-5);
  }
}

/// Seventeen times the imposed row of one joint becomes dependent on rows of other joints, and a
/// dropped row of this joint replaces it. Pivoting alone did not replace it: the loop opened by
/// 0.71 m.
TEST(RoundedInput, RowsOfAJointAreExchangedWhereOthersNeedTheirs) {
  const MechanismFile file = Rounded("cognates-eight-digits");
  for (const Method& method :
       MethodsAt({Enforcement::kAcceleration, Enforcement::kPosition}, {Coordinates::kJoint})) {
    SCOPED_TRACE(ToString(method));
    const Record record = RunFile(file, method, 1e-8, 10.0);
    EXPECT_EQ(record.Text("outcome"), "finished") << record.Text("message");
    EXPECT_EQ(record.Text("warnings"), "");
    EXPECT_GE(record.Number("mode_changes"), 10);
    // the exact linkage has 1.4e-7 m at level acceleration
    EXPECT_LT(record.Number("drift_position_max"), 1e-6);
    // rounding of 2e-8 m, by seventeen changes and expansion coefficients of two
    EXPECT_LT(record.Number("energy_error_relative"), 1e-5);
  }
}

/// A planar four-bar in space with angles of three digits: axes lean by 8e-4 rad. Its rank is
/// determined within the accuracy that the file states.
TEST(RoundedInput, RankIsJudgedByTheStatedAccuracy) {
  MechanismFile file = Rounded("four-bar-three-digits");
  for (const double accuracy : {1e-3, 1e-2}) {
    file.description.accuracy = accuracy;
    const Redundancy found = FindRedundancy(file.description);
    EXPECT_EQ(found.rows, 5);
    EXPECT_EQ(found.rank, 2) << accuracy;
    EXPECT_EQ(AnalyseStructure(file.description).freedom_at_start(), 1);
    for (const Method& method : MethodsAt({Enforcement::kPosition}, {Coordinates::kJoint})) {
      SCOPED_TRACE(ToString(method));
      const Record record = RunFile(file, method, 1e-8, 2.0);
      EXPECT_EQ(record.Text("outcome"), "finished") << record.Text("message");
      // changes of the dropped rows move the mechanism by about the lean
      EXPECT_LT(record.Number("energy_error_relative"), 10 * 8e-4);
    }
  }
}

/// A crank that is turned at a constant speed exchanges no energy per turn. With rows kept until
/// expansion coefficients exceed ten instead of two, the error was 3e-2 of the kinetic energy.
TEST(RoundedInput, DrivenLinkagesExchangeNoEnergyPerTurn) {
  constexpr double kSpeed = 3.0;
  MechanismFile file = SixDecimals("goldberg-5r");
  file.description.joints[0].motions = {{0, Polynomial{.coefficients = {0.0, kSpeed}}}};
  std::erase_if(file.description.initial.coordinates,
                [](const JointValues& values) { return values.joint == 0; });
  for (const Method& method : MethodsAt({Enforcement::kVelocity}, {Coordinates::kJoint})) {
    const Record record = RunFile(file, method, 1e-8, 2.0 * kPi / kSpeed);
    EXPECT_EQ(record.Text("outcome"), "finished") << ToString(method);
    // Speeds miss by the lean of 1e-6 times T^2 times the ratio of joint speeds, here above 100.
    EXPECT_LT(record.Number("energy_error_relative"), 5e-3) << ToString(method);
  }
}

/// Speeds of all joints of a four-bar in a file of six digits and more.
TEST(RoundedInput, GivenSpeedsOfALoopFitWithinTheAccuracy) {
  MechanismDescription description = Shipped("four-bar").description;
  description.initial.speeds = {{0, {2.0}}};
  const Start<double> exact = StartOf<Planar>(description);
  ASSERT_EQ(exact.outcome, Outcome::kFinished);
  ASSERT_EQ(exact.u.size(), 3);
  for (const double unit : {1e-6, 1e-8, 1e-3}) {
    description.initial.speeds.clear();
    for (int j = 0; j < 3; ++j) {
      description.initial.speeds.push_back({j, {std::round(exact.u[j] / unit) * unit}});
    }
    const Start<double> start = StartOf<Planar>(description);
    EXPECT_EQ(start.outcome == Outcome::kFinished, unit < 1e-3) << start.message;
    EXPECT_EQ(start.message.find("they fit with an") == std::string::npos, unit < 1e-3);
    if (unit == 1e-3) continue;
    EXPECT_FALSE(start.has_given_speeds);
    EXPECT_LT((start.u - exact.u).lpNorm<Eigen::Infinity>(), unit);
    EXPECT_LT(start.speed_residual, 64 * kEps);
  }
}

/// Squares of these speeds overflow.
TEST(RoundedInput, HugeSpeedsThatContradictEachOtherDoNotFit) {
  MechanismDescription description = Shipped("four-bar").description;
  description.initial.speeds = {{0, {1e300}}, {1, {1.0}}, {2, {1.0}}};
  EXPECT_EQ(StartOf<Planar>(description).outcome, Outcome::kInconsistentStart);
}

/// Four decimals: the position closes with the default accuracy, but the given speed does not fit.
TEST(RoundedInput, SpeedsThatDoNotFitNameTheAccuracyWithWhichTheyDo) {
  MechanismDescription description = Rounded("waldron-four-digits").description;
  const std::string message = StartOf<Spatial>(description).message;
  EXPECT_NE(message.find("no speeds that fit"), std::string::npos) << message;
  const std::string hint = "they fit with an \"accuracy\" of ";
  const std::size_t at = message.find(hint);
  ASSERT_NE(at, std::string::npos) << message;
  description.accuracy = std::stod(message.substr(at + hint.size()));
  EXPECT_LT(description.accuracy, 1e-3);
  const Start<double> start = StartOf<Spatial>(description);
  EXPECT_EQ(start.outcome, Outcome::kFinished) << start.message;
}

/// Positions where the directions released elsewhere would leave the joint open.
TEST(RoundedInput, StartsOfLinkagesAreClosed) {
  for (const double angle : {2.4, 2.5, 5.9}) {
    MechanismDescription description = SixDecimals("bennett-turning").description;
    for (JointValues& values : description.initial.coordinates) {
      if (description.joints[values.joint].name == "J1") values.values = {angle};
    }
    const MechanismDescription run_as = Release(description, FindRedundancy(description));
    const Mechanism<Spatial, double> mechanism(run_as, Coordinates::kJoint);
    const Start<double> start = Assemble<Spatial>(run_as, mechanism);
    ASSERT_EQ(start.outcome, Outcome::kFinished) << angle << ": " << start.message;
    Kinematics<Spatial, double> kinematics(mechanism);
    kinematics.UpdatePosition(start.q);
    for (const int joint : mechanism.constraints()) {
      const auto open = kinematics.Forbidden(joint, kinematics.ConstraintMismatch(joint));
      // Leans of 1e-6 rad, times coefficients that pivoting keeps near one.
      EXPECT_LT(open.angular.norm() + open.linear.norm(), 1e-4) << angle;
    }
  }
}

/// Gaps of rounded loops change along their free motion, too, but only by their own size: the
/// assembly once followed the motion for 0.05 rad to make a gap of 4.3e-6 rad smaller by 0.5 %.
TEST(RoundedInput, StartsDoNotFollowTheFreeMotion) {
  const auto start = [](MechanismDescription description, double missed) {
    description.initial.held.clear();
    description.initial.speeds.clear();
    for (JointValues& values : description.initial.coordinates) values.values[0] += missed;
    const Start<double> found = StartOf<Spatial>(description);
    EXPECT_EQ(found.outcome, Outcome::kFinished) << found.message;
    return found.q;
  };
  for (const double missed : {0.0, 0.005}) {
    for (const std::string name : {"bennett-turning", "goldberg-5r", "myard-5r"}) {
      const MechanismFile exact = Overconstrained(name);
      const VectorX<double> apart =
          start(SixDecimals(name).description, missed) - start(exact.description, missed);
      // Leans of 1e-6 rad times ratios of angles below 100. Steps of different damping lead from a
      // missed guess to positions that differ in second order.
      EXPECT_LT(apart.lpNorm<Eigen::Infinity>(), 1e-4 + 30.0 * missed * missed)
          << name << " " << missed;
    }
  }
}

TEST(RoundedInput, StartsWhereItIsDrawn) {
  for (const char* name : {"octahedron", "scissor-lift-tilted"}) {
    const MechanismFile file = SixDecimals(name);
    const Mechanism<Spatial, double> mechanism(file.description, Coordinates::kJoint);
    const Start<double> start = Assemble<Spatial>(file.description, mechanism);
    ASSERT_EQ(start.outcome, Outcome::kFinished) << name << ": " << start.message;
    const VectorX<double> drawn = GuessedPositions(file.description, mechanism);
    EXPECT_LT((start.q - drawn).lpNorm<Eigen::Infinity>(), 1e-3) << name;
  }
}

/// A coarse accuracy does not leave loops open that close nearby.
TEST(RoundedInput, CoarseDrawingsCloseExactly) {
  MechanismFile file = FourBar(kQuarter);
  file.description.accuracy = 0.1;
  file.description.initial.coordinates = {{0, {0.3}}, {1, {-0.2}}, {2, {0.25}}};
  const Mechanism<Spatial, double> mechanism(file.description, Coordinates::kJoint);
  const Start<double> start = Assemble<Spatial>(file.description, mechanism);
  ASSERT_EQ(start.outcome, Outcome::kFinished) << start.message;
  const VectorX<double> drawn = GuessedPositions(file.description, mechanism);
  EXPECT_GT((start.q - drawn).lpNorm<Eigen::Infinity>(), 0.04) << "too near to test it";
  // Sums of three lengths below 1 m and of three angles.
  EXPECT_LT(start.position_residual, 16 * kEps);
}

}  // namespace loopbench::harness::reference::rounded_test
