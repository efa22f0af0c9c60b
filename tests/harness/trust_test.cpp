// Planted wrong results: each is flagged by its reference or, without a reference, by its own
// warnings and by disagreement. Correct results are not flagged.
#include "harness/judge/analysis.h"
#include "harness/observers/reference.h"
#include "tests/harness/records.h"
#include "tests/reference/cases.h"
#ifdef LOOPBENCH_PRECISIONS
#include "harness/precision/make_reference.h"
#endif

namespace loopbench::harness::trust_test {

using namespace reference;
using enum Enforcement;

Record RunOne(const MechanismFile& file, const Method& method, double rtol, double horizon,
              const Reference* reference = nullptr) {
  const Experiment experiment = Single(file);
  return RunCase(experiment, CaseOf(experiment, file.description.name, method, rtol, horizon),
                 reference);
}

const Method kOdca{.formulation = "odca"};
const Method kOdcaPosition{.formulation = "odca", .enforcement = kPosition};
const Method kMultipliers{.formulation = "lagrange", .enforcement = kVelocity};

/// `wrong` with the name of what it pretends to be.
Record Disguised(Record wrong, const Record& as) {
  for (const char* key : {"problem_id", "formulation", "enforcement", "rtol", "atol"}) {
    wrong.Set(key, *as.Find(key));
  }
  return wrong;
}

std::vector<Record> Runs(const MechanismFile& file, std::initializer_list<Method> methods,
                         double horizon, std::initializer_list<double> tolerances) {
  std::vector<Record> records;
  for (const Method& method : methods) {
    for (const double rtol : tolerances) records.push_back(RunOne(file, method, rtol, horizon));
  }
  return records;
}

std::string AllWarnings(const std::vector<Record>& records) {
  std::string all;
  for (const Record& record : records) all += "[" + record.Text("warnings") + "]";
  return all;
}

/// A crank that a torque turns.
MechanismFile Driven(double torque) {
  MechanismFile file = Shipped("spinning-crank");
  file.description.forces.push_back(JointTorque{.joint = 0, .value = Polynomial{{torque}}});
  return file;
}

TEST(Trust, TorqueOfTheWrongSignInOneColumn) {
  std::vector<Record> records =
      Runs(Driven(0.5), {kOdcaPosition, kMultipliers}, 2.0, {1e-6, 1e-8, 1e-10});
  SetWarnings(&records);
  EXPECT_EQ(AllWarnings(records), "[][][][][][]");
  // the finest of the second method
  records[5] = Disguised(RunOne(Driven(-0.5), kMultipliers, 1e-10, 2.0), records[5]);
  SetWarnings(&records);
  EXPECT_TRUE(HasWarning(records[5], kDisagreementWarning)) << AllWarnings(records);
  // and with it the method's runs at no finer tolerance come nearer to it
  EXPECT_TRUE(HasWarning(records[4], kRefinementWarning)) << AllWarnings(records);
}

TEST(Trust, ToleranceThatIsNotHeeded) {
  std::vector<Record> records =
      Runs(Shipped("pendulum"), {kOdcaPosition}, 5.0, {1e-6, 1e-8, 1e-10});
  SetWarnings(&records);
  EXPECT_EQ(AllWarnings(records), "[][][]");
  const Record coarse = records[0];
  for (Record& record : records) record = Disguised(coarse, record);
  SetWarnings(&records);
  for (const Record& record : records) {
    EXPECT_TRUE(HasWarning(record, kRefinementWarning)) << AllWarnings(records);
  }
}

TEST(Trust, RefinementThatComesNoNearer) {
  const MechanismFile file = Shipped("pendulum");
  std::vector<Record> records = Runs(file, {kOdcaPosition}, 5.0, {1e-4, 1e-6, 1e-8, 1e-10});
  // the finest is that of another start
  MechanismFile other = file;
  other.description.initial.coordinates.front().values.front() += 1e-2;
  records[3] = Disguised(RunOne(other, kOdcaPosition, 1e-10, 5.0), records[3]);
  SetWarnings(&records);
  EXPECT_FALSE(HasWarning(records[0])) << AllWarnings(records);
  EXPECT_TRUE(HasWarning(records[2], kRefinementWarning)) << AllWarnings(records);
  EXPECT_TRUE(HasWarning(records[3], kRefinementWarning)) << AllWarnings(records);
}

TEST(Trust, RedundantLoopThatDrifts) {
  // with its redundant rows kept, and regularized where they must be, Bennett's loop opens
  Experiment experiment = Single(Shipped("bennett"));
  experiment.compile.redundancy = false;
  const Record record = RunCase(experiment, CaseOf(experiment, "bennett", kOdca, 1e-8, 50.0));
  ASSERT_EQ(record.Text("outcome"), "finished");
  EXPECT_TRUE(HasWarning(record, kDriftWarning)) << record.Number("drift_position_max");
}

TEST(Trust, DriveThatStepsPassBy) {
  // 5 mN m at 2000 rad/s move the crank by less than the tolerance, and by chance not at all
  MechanismFile file = Shipped("pendulum");
  file.description.forces.push_back(JointTorque{
      .joint = 0,
      .value = Harmonic{.mean = 0.0, .amplitude = 5e-3, .omega = 2000.0, .phase = 0.3}});
  const Record aliased = RunOne(file, kOdca, 1e-3, 2.0);
  ASSERT_EQ(aliased.Text("outcome"), "finished");
  EXPECT_TRUE(HasWarning(aliased, kDriveWarning)) << aliased.Number("step_longest");
  EXPECT_EQ(aliased.Number("drive_frequency"), 2000.0);
  const Record seen = RunOne(file, kOdca, 1e-12, 0.2);
  EXPECT_FALSE(HasWarning(seen, kDriveWarning)) << seen.Number("step_longest");
}

TEST(Trust, SpringThatPassesZeroLength) {
  // a mass on a line, pulled to its middle with 5 N + x: x = 6 cos t - 5
  const auto on_line = [](double start, double preload) {
    return ParseMechanism(fmt::format(R"({{"name": "line", "gravity": [0, 0],
          "bodies": [{{"name": "m", "mass": 1, "inertia": 1}}],
          "joints": [{{"name": "s", "type": "prismatic", "from": {{"body": "ground"}},
                      "to": {{"body": "m"}}}}],
          "forces": [{{"type": "spring_damper", "from": {{"body": "ground"}}, "to": {{"body": "m"}},
                      "stiffness": 1, "preload": {}}}],
          "initial": {{"coordinates": {{"s": {}}}}}}})",
                                      preload, start),
                          "line.json");
  };
  const Record free = RunOne(on_line(1.0, 0.0), kOdca, 1e-8, 2.0);
  EXPECT_FALSE(HasWarning(free)) << free.Text("warnings");
  const Record near = RunOne(on_line(1.0, 5.0), kOdca, 1e-8, 0.3);
  EXPECT_FALSE(HasWarning(near)) << near.Text("warnings");
  const Record passing = RunOne(on_line(1.0, 5.0), kOdca, 1e-8, 0.7);
  EXPECT_TRUE(HasWarning(passing, kSpringWarning)) << passing.Text("warnings");
  EXPECT_EQ(passing.Text("spring_reversal"), "spring_damper between ground and m");
  EXPECT_NEAR(passing.Number("spring_reversal_t"), std::acos(5.0 / 6.0), 0.05);
  const Record resting = RunOne(on_line(0.0, -5.0), kOdca, 1e-8, 1.0);
  EXPECT_TRUE(HasWarning(resting, kSpringWarning)) << resting.Text("warnings");
  EXPECT_EQ(resting.Number("spring_reversal_t"), 0.0);
}

// A spring of 1 m from a wheel's pivot to its rim: steps of some radians.
TEST(Trust, SpringsThatTurnPassNoZeroLength) {
  const MechanismFile wheel = ParseMechanism(R"({
    "name": "wheel", "gravity": [0, 0], "ground": {"points": {"O": [0, 0]}},
    "bodies": [{"name": "p", "mass": 1, "inertia": 1, "points": {"A": [1, 0]}}],
    "joints": [{"name": "J", "type": "revolute", "from": {"body": "ground"}, "to": {"body": "p"}}],
    "forces": [{"type": "spring_damper", "from": {"body": "ground", "at": "O"},
                "to": {"body": "p", "at": "A"}, "stiffness": 10, "length": 0.5}],
    "initial": {"coordinates": {"J": 0}, "fixed": ["J"], "speeds": {"J": 30}}})",
                                             "wheel.json");
  const Record record = RunOne(wheel, kOdca, 1e-6, 1.0);
  EXPECT_GT(record.Number("step_longest") * 30.0, 2.7);  // beyond 154 degrees
  EXPECT_FALSE(HasWarning(record, kSpringWarning)) << record.Text("warnings");
}

TEST(Trust, StepControlThatStruggles) {
  Record record = RunOne(Shipped("pendulum"), kOdca, 1e-6, 1.0);
  EXPECT_EQ(record.Text("warnings"), "");
  EXPECT_GT(record.Number("step_shortest"), 0.0);
  EXPECT_GE(record.Number("step_longest"), record.Number("step_shortest"));
  const auto rejected = static_cast<std::int64_t>(record.Number("steps")) + 20;
  EXPECT_EQ(OwnWarnings(Changed(record, "rejected", rejected)), kStepsWarning);
  EXPECT_EQ(OwnWarnings(Changed(record, "step_shortest", 1e-13, "step_shortest_t", 0.5)),
            kStepsWarning);
}

#ifdef LOOPBENCH_PRECISIONS

Reference ReferenceOf(const MechanismFile& file, double horizon) {
  const Reference reference = MakeReference(file.description, horizon, LinkLength(file.description),
                                            {.scalar = "long-double", .points = 41, .cpu_s = 20.0});
  EXPECT_EQ(reference.trust_horizon, horizon) << reference.message;
  return reference;
}

TEST(TrueError, FollowsTheToleranceAndChangesNoBit) {
  for (const char* name : {"four-bar", "bennett", "driven-four-bar", "four-islands"}) {
    const MechanismFile file = Shipped(name);
    const Reference reference = ReferenceOf(file, 1.0);
    double before = INFINITY;
    for (const double rtol : {1e-6, 1e-8, 1e-10}) {
      for (const char* profile : {"ode45", "kvaerno-54"}) {
        Experiment experiment = Single(file);
        Case one = CaseOf(experiment, file.description.name, kOdcaPosition, rtol, 1.0);
        one.integrator = profile;
        const Record alone = RunCase(experiment, one);
        const Record held = RunCase(experiment, one, &reference);
        for (const char* key : {"state_hash", "steps", "rhs_evaluations", "drift_position_max"}) {
          EXPECT_EQ(alone.Text(key), held.Text(key)) << name << " " << profile << " " << key;
        }
        const double error = held.Number("error_position_max");
        EXPECT_GE(error, held.Number("error_position_rms"));
        EXPECT_GE(error, held.Number("error_position_end"));
        EXPECT_EQ(held.Number("error_points"), 41);
        EXPECT_EQ(held.Text("warnings"), "") << name << " " << error << " at " << rtol;
        if (std::string(profile) == "ode45") {
          // a hundredth of the tolerance: a tenth of the error at least, over round-off
          EXPECT_LT(error, before / 10 + 1e-12) << name;
          before = error;
        }
      }
    }
  }
}

TEST(TrueError, IsThatOfTheClosedForm) {
  // the pendulum's only body: the distance of its tip is its angle times 1 m, for small errors
  const MechanismFile file = Shipped("pendulum");
  const Reference reference = ReferenceOf(file, 10.0);
  const Record record = RunOne(file, kOdca, 1e-6, 10.0, &reference);
  const double closed = record.Number("closed_form_error_max");
  // that sees all steps, this 41 times
  EXPECT_LE(record.Number("error_angle_max"), closed * 1.001);
  EXPECT_GE(record.Number("error_angle_max"), closed / 3);
  EXPECT_NEAR(record.Number("error_position_max") / record.Number("error_rotation_max"), 1.0, 1e-3);
}

TEST(TrueError, TellsLateFromAstray) {
  // the same motion, a hundredth of a second later: all of it is phase
  const MechanismFile file = Shipped("four-bar");
  const MechanismDescription& user = file.description;
  const Reference at = MakeReference(user, 2.0, 1.0, {.points = 2001});
  const Compiled compiled = Compile(user, {.islands = false});
  const Measured measured{user, compiled};
  for (const std::size_t k : {500u, 1100u, 1700u}) {
    const Distance lag = DistanceOf(measured, -1, at.snapshots[k - 10], at.snapshots[k]);
    // to first order in 0.01 s: what is left is of second order
    EXPECT_NEAR(lag.late, 0.01, 2e-3);
    EXPECT_LT(lag.shape, 0.1 * lag.position);
    const Distance none = DistanceOf(measured, -1, at.snapshots[k], at.snapshots[k]);
    EXPECT_EQ(none.position + none.rotation + none.velocity + none.shape + std::abs(none.late),
              0.0);
  }
}

TEST(Trust, TheReferenceDecidesWhoIsRight) {
  // through a singular position: level velocity ends on another branch than level projection
  const MechanismFile file = Shipped("peaucellier");
  const Reference reference = MakeReference(file.description, 1.0, LinkLength(file.description),
                                            {.scalar = "long-double", .points = 41, .cpu_s = 2.0});
  std::vector<Record> records;
  for (const Enforcement level : {kVelocity, kPosition}) {
    records.push_back(RunOne(
        file, {.formulation = level == kVelocity ? "reduction" : "odca", .enforcement = level},
        1e-8, 1.0, &reference));
  }
  SetWarnings(&records);
  if (reference.trust_horizon == 1.0) {
    EXPECT_EQ(records[1].Text("warnings"), "") << records[1].Number("error_position_end");
    EXPECT_TRUE(HasWarning(records[0], kErrorWarning)) << AllWarnings(records);
  } else {
    EXPECT_TRUE(HasWarning(records[0], kSingularWarning)) << AllWarnings(records);
    EXPECT_TRUE(HasWarning(records[1], kDisagreementWarning)) << AllWarnings(records);
  }
}

TEST(Trust, WrongResultsAloneAreSeenByTheReference) {
  const MechanismFile right = Driven(0.5);
  const Reference reference = ReferenceOf(right, 1.0);
  EXPECT_EQ(RunOne(right, kOdcaPosition, 1e-8, 1.0, &reference).Text("warnings"), "");
  Record wrong = RunOne(Driven(-0.5), kOdcaPosition, 1e-8, 1.0, &reference);
  EXPECT_TRUE(HasWarning(wrong, kErrorWarning)) << wrong.Text("warnings");
  // a tolerance that is not heeded
  const Record coarse = RunOne(right, kOdcaPosition, 1e-3, 1.0, &reference);
  ExpectWords(OwnWarnings(Changed(coarse, "rtol", 1e-9, "atol", 1e-9)), {kErrorWarning});
}

TEST(ReferenceFile, ReadsBackInEveryBitAndRefusesDamage) {
  const MechanismFile file = Shipped("bennett");
  const Reference reference =
      MakeReference(file.description, 0.5, LinkLength(file.description), {.points = 6});
  const std::filesystem::path path =
      std::filesystem::path(testing::TempDir()) / "loopbench-reference" / "one.json";
  std::filesystem::remove(path);
  EXPECT_FALSE(ReadReference(path, "one", file.description));
  WriteReference(path, "one", file.description, reference);
  const auto again = ReadReference(path, "one", file.description);
  ASSERT_TRUE(again);
  EXPECT_EQ(again->times, reference.times);
  EXPECT_EQ(again->trust_horizon, reference.trust_horizon);
  ASSERT_EQ(again->snapshots.size(), reference.snapshots.size());
  for (std::size_t k = 0; k < reference.snapshots.size(); ++k) {
    EXPECT_EQ(again->bounds[k].position, reference.bounds[k].position);
    for (std::size_t i = 1; i < reference.snapshots[k].bodies.size(); ++i) {
      const BodyState &a = again->snapshots[k].bodies[i], &b = reference.snapshots[k].bodies[i];
      EXPECT_EQ(a.pose.p, b.pose.p);
      EXPECT_EQ(a.pose.R.col(0), b.pose.R.col(0));
      EXPECT_EQ(a.angular_velocity, b.angular_velocity);
    }
  }
  EXPECT_THROW(ReadReference(path, "other", file.description), std::runtime_error);
  std::string text = ReadFile(path);
  text[text.size() / 2] = text[text.size() / 2] == '1' ? '2' : '1';
  WriteFileAtomically(path, text);
  EXPECT_THROW(ReadReference(path, "one", file.description), std::runtime_error);
  std::filesystem::remove(path);
}

#endif

}  // namespace loopbench::harness::trust_test
