// How each kind of failure ends in a record, and that none of them tears it.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>
#include <string_view>
#include <vector>

#include "harness/base/record.h"
#include "harness/run/run.h"
#include "tests/reference/cases.h"

namespace loopbench::harness {
namespace run_case_failures_test {

using namespace reference;

constexpr double kTolerance = 1e-8;
const Method kOdcaJoint = Published("odca", Coordinates::kJoint);

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

}  // namespace run_case_failures_test
}  // namespace loopbench::harness
