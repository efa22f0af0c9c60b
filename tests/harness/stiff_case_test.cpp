// Stiff mechanisms under explicit and implicit profiles, with Jacobians of both kinds: steps,
// accuracy and what records hold.
#include <gtest/gtest.h>

#include <cmath>
#include <iostream>
#include <string>
#include <vector>

#include "harness/run/run.h"
#include "tests/reference/cases.h"

namespace loopbench::harness {
namespace stiff_case_test {

using namespace reference;

Record RunStiff(const std::string& problem, const Method& method, const std::string& profile,
                double tolerance, double horizon, JacobianKind jacobian = JacobianKind::kForward) {
  const Experiment experiment =
      Single(ReadMechanism(kConfigs / "mechanisms" / (problem + ".json")));
  Case one = CaseOf(experiment, problem, method, tolerance, horizon);
  one.integrator = profile;
  one.jacobian = jacobian;
  one.keys = CaseKeys(experiment, one);
  return RunCase(experiment, one);
}

double LastAngle(const Record& record, const std::string& joint) {
  return record.Numbers("series.angle." + joint).back();
}

class StiffCase : public testing::TestWithParam<Method> {};

INSTANTIATE_TEST_SUITE_P(EveryFormulation, StiffCase,
                         testing::Values(Published("odca", Coordinates::kJoint),
                                         Published("lagrange", Coordinates::kJoint),
                                         Published("lagrange", Coordinates::kAbsolute),
                                         Published("reduction", Coordinates::kJoint)),
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

// Newton's iteration ends at a hundredth of the tolerance per stage, wherever its Jacobians are
// from; a run of some hundred steps adds up to the tolerance.
TEST_P(StiffCase, JacobiansOfBothKindsGiveTheSameMotionForwardOnesWithFewerEvaluations) {
  struct Run {
    std::string problem, angle;
    double horizon;
  };
  for (const Run& run : {Run{"elastic-crank", "OA", 0.5}, {"flyball-governor", "Z", 0.5}}) {
    for (const Enforcement level :
         {Enforcement::kAcceleration, Enforcement::kVelocity, Enforcement::kPosition}) {
      Method method = GetParam();
      method.enforcement = level;
      const auto with = [&](JacobianKind kind) {
        const Record record =
            RunStiff(run.problem, method, "kennedy-carpenter-43", 1e-7, run.horizon, kind);
        EXPECT_EQ(record.Text("outcome"), "finished") << record.Text("message");
        return record;
      };
      SCOPED_TRACE(run.problem + ", " + ToString(method));
      const Record forward = with(JacobianKind::kForward);
      const Record quotients = with(JacobianKind::kFiniteDifference);
      if (HasFailure()) return;
      EXPECT_NEAR(LastAngle(forward, run.angle), LastAngle(quotients, run.angle), 1e-7);
      const auto evaluations = [](const Record& record) {
        return record.Number("rhs_evaluations") + record.Number("newton_rhs_evaluations");
      };
      EXPECT_EQ(forward.Number("newton_rhs_evaluations"), 0);
      EXPECT_LT(evaluations(forward), evaluations(quotients));
      EXPECT_LE(forward.Number("newton_failures"), quotients.Number("newton_failures") + 1);
      std::cout << run.problem << " " << ToString(method) << ": steps " << forward.Number("steps")
                << " and " << quotients.Number("steps") << ", evaluations " << evaluations(forward)
                << " and " << evaluations(quotients) << "\n";
    }
  }
}

TEST(StiffRecords, RecordsOfImplicitProfilesCountNewton) {
  const Method method = Published("odca", Coordinates::kJoint);
  const Record record = RunStiff("elastic-crank", method, "kvaerno-54", 1e-6, 0.1);
  EXPECT_EQ(record.Text("jacobian"), "forward");
  EXPECT_GE(record.Number("newton_jacobians"), record.Number("steps"));
  // eight components, eight columns at once
  EXPECT_EQ(record.Number("newton_rhs_evaluations"), 0);
  EXPECT_EQ(record.Number("newton_dual_evaluations"), record.Number("newton_jacobians"));
  const Record quotients =
      RunStiff("elastic-crank", method, "kvaerno-54", 1e-6, 0.1, JacobianKind::kFiniteDifference);
  EXPECT_EQ(quotients.Text("jacobian"), "finite-difference");
  EXPECT_EQ(quotients.Number("newton_rhs_evaluations"), 8 * quotients.Number("newton_jacobians"));
  EXPECT_EQ(quotients.Number("newton_dual_evaluations"), 0);
  EXPECT_GT(record.Number("newton_iterations"), record.Number("steps"));
  EXPECT_GE(record.Number("newton_failures"), 0);
  const Record plain = RunStiff("four-bar", method, "ode45", 1e-6, 0.1);
  EXPECT_EQ(plain.Find("newton_iterations"), nullptr);
  EXPECT_EQ(plain.Find("jacobian"), nullptr);
}

}  // namespace stiff_case_test
}  // namespace loopbench::harness
