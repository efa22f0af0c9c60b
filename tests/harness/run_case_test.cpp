// One case from start to record: its contents, that it is the same every time, and how each kind of
// failure ends in a record that is whole.
#include "harness/base/record.h"
#include "harness/judge/tables.h"
#include "mechanism/description/library.h"
#include "tests/reference/cases.h"

namespace loopbench::harness::run_case_test {

using namespace reference;

constexpr double kTolerance = 1e-8;
const Method kOdcaJoint = Published("odca", Coordinates::kJoint);

/// A bar that swings about the origin like a point mass at 1 m, released at `angle` from +x.
MechanismFile BarAt(double angle) {
  MechanismFile file;
  file.description.name = "bar";
  file.description.gravity = {0.0, -9.81, 0.0};
  file.description.bodies.push_back(Bar("bar", 1.0, 1.0, 0.25));
  file.description.joints.push_back(
      Revolute("O", kGround, Eigen::Vector3d::Zero(), 1, Eigen::Vector3d::Zero()));
  file.description.initial.coordinates.push_back({0, {angle}});
  file.observe.closed_form = PendulumForm{"bar", -std::numbers::pi / 2, 9.81};
  return file;
}

TEST(FinishedCase, HasAValueInEveryColumnOfTheDriftTable) {
  // the one problem kind that has a branch and a closed form as well
  for (const Method& method : PublishedMethods()) {
    const Record record = RunPaper("parallelogram", method, kTolerance, 0.5);
    ASSERT_EQ(record.Text("outcome"), "finished");
    EXPECT_EQ(record.Number("t_reached"), 0.5);
    for (const TableColumn& table_column : ColumnsOfKind("drift", false)) {
      if (table_column.key == "correction_max") continue;  // nothing here corrects
      if (table_column.key == "agreement") continue;       // needs another run
      EXPECT_TRUE(IsSet(record, table_column.key)) << table_column.key;
    }
  }
}

TEST(FinishedCase, MeasuresFiniteNumbers) {
  const Record record = RunPaper("seven-bar", kOdcaJoint, kTolerance, 2.0);
  for (const char* key : {"drift_position_max", "drift_rotation_max", "drift_velocity_max",
                          "drift_acceleration_max", "loop_closure_max", "energy_error_max",
                          "branch_error_max", "rcond_min", "drift.loop.OC", "drift.loop.FB"}) {
    EXPECT_TRUE(std::isfinite(record.Number(key))) << key;
  }
  EXPECT_EQ(record.Number("rank_min"), 4);  // two planar pins
  EXPECT_EQ(record.Number("rank_constraints_min"), 4);
  EXPECT_EQ(record.Text("message"), "");
  EXPECT_EQ(record.Number("drift_position_max"), record.Number("loop_closure_max"));
  EXPECT_GE(record.Number("rhs_evaluations"), 6 * record.Number("steps"));
}

TEST(FinishedCase, RankIsThatOfTheLoopsAndOfAllConstraintsOfTheSet) {
  Method absolute = kOdcaJoint;
  absolute.coordinates = Coordinates::kAbsolute;
  const Record record = RunPaper("seven-bar", absolute, kTolerance, 0.5);
  EXPECT_EQ(record.Number("rank_min"), 4) << "as in joint coordinates";
  EXPECT_EQ(record.Number("rank_constraints_min"), 16) << "18 speeds less 2 degrees of freedom";
}

/// Newton steps of projections are the work that evaluations do not count. On a regular mechanism
/// one a step is enough at this tolerance, and what it takes away neither grows nor fades, while
/// the energy's error, which nothing takes away, grows with time.
TEST(FinishedCase, CountsProjectionsAndTheirGrowth) {
  const Method position{.formulation = "odca", .enforcement = Enforcement::kPosition};
  const Record record = RunPaper("four-bar", position, kTolerance, 300.0);
  ASSERT_EQ(record.Text("outcome"), "finished");
  const double steps = record.Number("steps"), iterations = record.Number("projection_iterations");
  EXPECT_GE(iterations, 0.9 * steps);
  EXPECT_LE(iterations, 1.1 * steps);
  EXPECT_EQ(record.Number("rhs_equivalents"), record.Number("rhs_evaluations") + iterations);
  // 0.125 and 0.25: a running maximum lags by one of some 200 swings, exponents lie 1 apart
  EXPECT_NEAR(record.Number("correction_growth_exponent"), 0.0, 0.125);
  EXPECT_NEAR(record.Number("energy_growth_exponent"), 1.0, 0.25);

  const Record without = RunPaper("four-bar", kOdcaJoint, kTolerance, 1.0);
  EXPECT_EQ(without.Number("rhs_equivalents"), without.Number("rhs_evaluations"));
  EXPECT_FALSE(IsSet(without, "projection_iterations"));
  EXPECT_FALSE(IsSet(without, "correction_growth_exponent"));
}

TEST(FinishedCase, KeepsSeriesOfDriftEnergyAndAnglesToTheEnd) {
  const Record record = RunPaper("four-bar", kOdcaJoint, kTolerance, 2.0);
  EXPECT_EQ(record.Numbers("series.t").back(), 2.0);
  EXPECT_EQ(record.Numbers("series.drift_t").back(), 2.0);
  EXPECT_EQ(record.Numbers("series.energy_t").back(), 2.0);
  EXPECT_EQ(record.Numbers("series.drift").back(), record.Number("drift_position_max"));
  for (const char* joint : {"OA", "AB", "BC", "OC"}) {
    EXPECT_EQ(record.Numbers(std::string("series.angle.") + joint).size(),
              record.Numbers("series.t").size())
        << joint;
  }
}

/// Largest distance of the series from the line through points of another, up to its end.
double GapBetween(const std::vector<double>& t, const std::vector<double>& value,
                  const std::vector<double>& line_t, const std::vector<double>& line) {
  double gap = 0.0;
  std::size_t at = 1;
  for (std::size_t i = 0; i < t.size() && t[i] <= line_t.back(); ++i) {
    while (line_t[at] < t[i]) ++at;
    const double part = (t[i] - line_t[at - 1]) / (line_t[at] - line_t[at - 1]);
    gap = std::max(gap, std::abs(value[i] - std::lerp(line[at - 1], line[at], part)));
  }
  return gap;
}

/// A pendulum that swings some fifty times: forty points drawn as a line show none of it.
TEST(FinishedCase, KeepsTheOpeningOfMotionsTooFastForItsPoints) {
  const auto run = [](int points, double horizon) {
    Experiment experiment = Single(BarAt(0.0));
    experiment.series_points = points;
    return RunCase(experiment, CaseOf(experiment, "bar", kOdcaJoint, kTolerance, horizon));
  };
  const Record all = run(1000000, 100.0), few = run(40, 100.0);
  EXPECT_FALSE(IsSet(all, "series.opening_t"));
  EXPECT_FALSE(IsSet(run(40, 1.0), "series.opening_t"));  // and half a swing needs none
  const std::vector<double>& t = all.Numbers("series.t");
  const std::vector<double>& angle = all.Numbers("series.angle.O");
  const auto [low, high] = std::ranges::minmax(angle);
  EXPECT_GT(GapBetween(t, angle, few.Numbers("series.t"), few.Numbers("series.angle.O")),
            0.1 * (high - low));
  const std::vector<double>& opening = few.Numbers("series.opening_t");
  ASSERT_EQ(opening.size(), 40u);
  // what the observer promises: a hundredth of the axis
  EXPECT_LE(GapBetween(t, angle, opening, few.Numbers("series.opening.angle.O")),
            0.01 * (high - low));
  EXPECT_GT(opening.back(), 2.0);  // a whole swing is seen
}

TEST(FinishedCase, KeepsAnglesAndDisplacementsApart) {
  const MechanismFile file = ReadMechanism(kConfigs / "mechanisms/flyball-governor.json");
  for (const Coordinates coordinates : {Coordinates::kJoint, Coordinates::kAbsolute}) {
    const Record record = RunFile(file, Published("odca", coordinates), kTolerance, 0.1);
    for (const JointDescription& joint : file.description.joints) {
      if (joint.type != JointType::kRevolute && joint.type != JointType::kPrismatic) continue;
      const bool shifts = joint.type == JointType::kPrismatic;
      EXPECT_EQ(IsSet(record, "series.displacement." + joint.name), shifts) << joint.name;
      EXPECT_EQ(IsSet(record, "series.angle." + joint.name), !shifts) << joint.name;
    }
  }
}

TEST(FinishedCase, GivesTheSameBitsTwice) {
  for (Method method : PublishedMethods()) {
    for (const SolverKind solver : {SolverKind::kAsPublished, SolverKind::kRankRevealing}) {
      method.solver = solver;
      Record first = RunPaper("seven-bar", method, kTolerance, 3.0);
      Record second = RunPaper("seven-bar", method, kTolerance, 3.0);
      EXPECT_EQ(first.Text("state_hash"), second.Text("state_hash")) << ToString(method);
      // time alone may differ; in text, where undefined exponents are equal too
      for (const char* time : {"wall_s", "cpu_s"}) {
        first.Set(time, 0.0);
        second.Set(time, 0.0);
      }
      EXPECT_EQ(ToJsonLine(first), ToJsonLine(second)) << ToString(method);
    }
  }
}

TEST(FinishedCase, EnsembleLeavesTheUnperturbedRunAsItIs) {
  Case one = CaseOf(Paper(), "four-bar", kOdcaJoint, kTolerance, 3.0);
  const Record single = RunCase(Paper(), one);
  one.ensemble = 3;
  one.seed = 1;
  one.perturb = 0.02;
  const Record several = RunCase(Paper(), one);
  EXPECT_EQ(single.Text("state_hash"), several.Text("state_hash"));
  EXPECT_EQ(several.Number("ensemble"), 3);
  EXPECT_EQ(several.Number("ensemble_failed"), 0);
  EXPECT_EQ(single.Text("growth_resolved"), "false");
}

TEST(FinishedCase, StateHashesOfDifferentRunsDiffer) {
  const auto run = [](double tolerance) {
    return RunCase(Paper(),
                   Identified(Paper(), CaseOf(Paper(), "four-bar", kOdcaJoint, tolerance, 1.0)));
  };
  const Record coarse = run(1e-6), fine = run(1e-8);
  EXPECT_NE(coarse.Text("state_hash"), fine.Text("state_hash"));
  EXPECT_NE(coarse.Text("case_id"), fine.Text("case_id"));
}

TEST(FinishedCase, ClosedFormHoldsForAnAngleGivenAWholeTurnMore) {
  // -pi and +pi are the same position, on either side of the pendulum's range of angles; 30 steps
  // of at most the tolerance each
  const double bound = 30 * kTolerance;
  for (const double angle : {-std::numbers::pi, std::numbers::pi, 3 * std::numbers::pi}) {
    const Record record = RunFile(BarAt(angle), kOdcaJoint, kTolerance, 1.0);
    EXPECT_LE(record.Number("closed_form_error_max"), bound) << angle;
  }
}

TEST(FinishedCase, PendulumReleasedUprightIsARowAndNoException) {
  Record record;
  EXPECT_NO_THROW(record = RunFile(BarAt(std::numbers::pi / 2), kOdcaJoint, kTolerance, 0.5));
  EXPECT_EQ(record.Text("outcome"), "finished");
}

bool IsMeasured(const Record& record, std::string_view key) {
  return IsSet(record, key) && !std::isnan(record.Number(key));
}

/// The four-bar with its second ground pivot moved out along x.
MechanismFile FourBarWithGround(double length) {
  MechanismFile file = ReadMechanism(kConfigs / "mechanisms/four-bar.json");
  for (JointDescription& joint : file.description.joints) {
    if (joint.name != "OC") continue;
    (joint.from.body == kGround ? joint.from : joint.to).position = {length, 0.0, 0.0};
  }
  return file;
}

class SingularStart : public testing::TestWithParam<Method> {};

TEST_P(SingularStart, EndsAsSingularAtTimeZero) {
  for (const char* problem : {"parallelogram-singular-start", "toggle-singular-start"}) {
    const Record record = RunPaper(problem, GetParam(), kTolerance, 1.0);
    EXPECT_EQ(record.Text("outcome"), "singular") << problem;
    EXPECT_EQ(record.Number("t_reached"), 0.0) << problem;
    EXPECT_NE(record.Text("message").find("singular"), std::string::npos) << problem;
  }
}

TEST_P(SingularStart, ReportsNothingThatWasNotMeasured) {
  const Record record = RunPaper("parallelogram-singular-start", GetParam(), kTolerance, 1.0);
  ASSERT_EQ(record.Number("steps"), 0);
  for (const char* key :
       {"drift_position_max", "drift_velocity_max", "drift_acceleration_max", "loop_closure_max",
        "energy_error_max", "branch_error_max", "closed_form_error_max"}) {
    EXPECT_FALSE(IsMeasured(record, key)) << key << " = " << record.Text(key);
  }
  EXPECT_NE(record.Text("growth_regime"), "round-off");
}

TEST_P(SingularStart, KeepsTheConditionOfTheMatrixThatFailed) {
  const Record record = RunPaper("parallelogram-singular-start", GetParam(), kTolerance, 1.0);
  // the start is singular to round-off; 13 rows and columns have the largest matrix that fails
  EXPECT_TRUE(IsMeasured(record, "rcond_min"));
  EXPECT_LE(record.Number("rcond_min"), 13 * 13 * std::numeric_limits<double>::epsilon());
}

INSTANTIATE_TEST_SUITE_P(AsPublished, SingularStart, testing::ValuesIn(PublishedMethods()),
                         [](const auto& method) { return NameOf(method.param); });

TEST(UnreachableAssembly, IsARowThatNamesTheLoop) {
  // three bars of 1 m cannot span 5 m
  for (const Method& method : PublishedMethods()) {
    const Record record = RunFile(FourBarWithGround(5.0), method, kTolerance, 1.0);
    EXPECT_EQ(record.Text("outcome"), "inconsistent-start");
    EXPECT_NE(record.Text("message").find("\"OC\""), std::string::npos) << record.Text("message");
    EXPECT_NE(record.Text("message").find("residual"), std::string::npos);
    EXPECT_EQ(record.Number("t_reached"), 0.0);
    EXPECT_FALSE(IsMeasured(record, "drift_position_max"));
    EXPECT_FALSE(IsSet(record, "growth_regime")) << record.Text("growth_regime");
  }
}

TEST(UnreachableAssembly, OfAMemberCountsAsFailedAndTheRestIsAnalysed) {
  // bars 2 and 3 span 2 m, which the first bar's tip is from the far pivot at OA = 0.37 rad
  MechanismFile file = FourBarWithGround(2.9);
  file.description.initial.coordinates[0].values = {0.30};
  const Experiment experiment = Single(file);
  Case one = CaseOf(experiment, "four-bar", kOdcaJoint, kTolerance, 0.2);
  one.ensemble = 16;
  one.seed = 1;
  one.perturb = 0.2;
  const Record record = RunCase(experiment, one);
  EXPECT_GT(record.Number("ensemble_failed"), 0);
  EXPECT_LT(record.Number("ensemble_failed"), 16);
  EXPECT_EQ(record.Number("ensemble") + record.Number("ensemble_failed"), 16);
  EXPECT_EQ(record.Text("growth_resolved"), "false");
}

TEST(Limits, OfStepsEndTheRunWhereItStands) {
  Case one = CaseOf(Paper(), "four-bar", kOdcaJoint, kTolerance, 10.0);
  one.limits.steps = 20;
  const Record record = RunCase(Paper(), one);
  EXPECT_EQ(record.Text("outcome"), "step-limit");
  EXPECT_EQ(record.Number("steps"), 20);
  EXPECT_GT(record.Number("t_reached"), 0.0);
  EXPECT_LT(record.Number("t_reached"), 10.0);
  EXPECT_TRUE(IsMeasured(record, "drift_position_max"));
}

TEST(Limits, OfCpuTimeEndTheRunWhereItStands) {
  Case one =
      CaseOf(Paper(), "seven-bar", Published("lagrange", Coordinates::kAbsolute), 1e-12, 1e4);
  one.limits.cpu_s = 0.05;
  const Record record = RunCase(Paper(), one);
  EXPECT_EQ(record.Text("outcome"), "time-limit");
  EXPECT_LT(record.Number("t_reached"), 1e4);
  // checked every step: nothing here takes a tenth of a second
  EXPECT_LT(record.Number("cpu_s"), 1.0);
}

// What the reader takes a run takes; at the bound itself both refuse (config corpus, Integrator).
TEST(Limits, OfTolerancesAreThoseOfRuns) {
  const double least = std::nextafter(kMinTolerance, 1.0);
  const Record record = RunCase(Paper(), CaseOf(Paper(), "four-bar", kOdcaJoint, least, 0.1));
  EXPECT_NE(record.Text("outcome"), "");
  EXPECT_NE(record.Text("outcome"), "integrator-error") << record.Text("message");
  EXPECT_THROW(RunCase(Paper(), CaseOf(Paper(), "four-bar", kOdcaJoint, kMinTolerance, 0.1)),
               std::invalid_argument);
}

TEST(WrittenRecord, HoldsNoNanAndNoInfinity) {
  std::vector<Record> records;
  records.push_back(RunPaper("four-bar", kOdcaJoint, kTolerance, 0.1));
  records.push_back(RunPaper("parallelogram-singular-start", kOdcaJoint, kTolerance, 1.0));
  records.push_back(RunFile(FourBarWithGround(5.0), kOdcaJoint, kTolerance, 1.0));
  for (const Record& record : records) {
    // nan and inf are no words of JSON, nor of any other value of these records
    const std::string line = ToJsonLine(record);
    EXPECT_EQ(line.find("nan"), std::string::npos) << line;
    EXPECT_EQ(line.find("inf"), std::string::npos) << line;
    const Record back = FromJsonLine(line);
    for (const auto& [key, value] : back.items()) {
      if (const auto* number = std::get_if<double>(&value)) {
        EXPECT_TRUE(std::isfinite(*number)) << key;
      }
    }
  }
}

}  // namespace loopbench::harness::run_case_test
