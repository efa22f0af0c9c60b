// A stiff mechanism under explicit and implicit profiles: steps, accuracy and what records hold.
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "harness/run_case.h"
#include "tests/reference/cases.h"

namespace loopbench::harness {
namespace {

using namespace reference;
using enum FormulationKind;

Record RunStiff(const std::string& scene, const Column& column, const std::string& profile,
                double tolerance, double horizon) {
  const Experiment experiment = Single(ReadMechanism(kConfigs / "mechanisms" / (scene + ".json")));
  Case one = CaseOf(experiment, scene, column, tolerance, horizon);
  one.integrator = profile;
  return RunCase(experiment, one);
}

double LastAngle(const Record& record, const std::string& joint) {
  return record.Numbers("series.angle." + joint).back();
}

class StiffCase : public testing::TestWithParam<Column> {};

INSTANTIATE_TEST_SUITE_P(EveryFormulation, StiffCase,
                         testing::Values(Published(kOdca, Coordinates::kJoint),
                                         Published(kLagrange, Coordinates::kJoint),
                                         Published(kLagrange, Coordinates::kAbsolute),
                                         Published(kReduction, Coordinates::kJoint)),
                         [](const auto& one) { return NameOf(one.param); });

// The hub turns by its moment over its stiffness, less than 100 N m / 1e8 N m/rad = 1e-6 rad, and
// is over its own motion in a time short against a step: the oracle is the four-bar with a rigid
// first bar, integrated by an explicit pair. Tolerances are 1e-8; errors add up over some hundred
// steps.
TEST_P(StiffCase, ImplicitProfilesFollowTheRigidMotionInFewSteps) {
  const Record rigid = RunStiff("four-bar", GetParam(), "dormand-prince", 1e-11, 0.5);
  const Record explicit_run = RunStiff("elastic-crank", GetParam(), "dormand-prince", 1e-8, 0.5);
  ASSERT_EQ(explicit_run.Text("outcome"), "finished");
  EXPECT_NEAR(LastAngle(explicit_run, "OA"), LastAngle(rigid, "OA"), 5e-6);
  for (const char* profile : {"kennedy-carpenter-43", "kvaerno-54", "kennedy-carpenter-54"}) {
    const Record record = RunStiff("elastic-crank", GetParam(), profile, 1e-8, 0.5);
    ASSERT_EQ(record.Text("outcome"), "finished") << profile << record.Text("message");
    EXPECT_NEAR(LastAngle(record, "OA"), LastAngle(rigid, "OA"), 5e-6) << profile;
    EXPECT_NEAR(LastAngle(record, "hub"), LastAngle(explicit_run, "hub"), 1e-7) << profile;
    EXPECT_LT(10 * record.Number("steps"), explicit_run.Number("steps")) << profile;
  }
}

TEST(StiffRecords, RecordsOfImplicitProfilesCountNewton) {
  const Column column = Published(kOdca, Coordinates::kJoint);
  const Record record = RunStiff("elastic-crank", column, "kvaerno-54", 1e-6, 0.1);
  EXPECT_GE(record.Number("newton_jacobians"), record.Number("steps"));
  EXPECT_EQ(record.Number("newton_rhs_evaluations"), 8 * record.Number("newton_jacobians"));
  EXPECT_GT(record.Number("newton_iterations"), record.Number("steps"));
  EXPECT_GE(record.Number("newton_failures"), 0);
  const Record plain = RunStiff("four-bar", column, "ode45", 1e-6, 0.1);
  EXPECT_EQ(plain.Find("newton_iterations"), nullptr);
}

}  // namespace
}  // namespace loopbench::harness
