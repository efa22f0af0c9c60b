// Stiff mechanisms under explicit and implicit profiles, with Jacobians of both kinds: steps,
// accuracy and records. A system as the integrator sees it: Jacobians, orders.
#include "harness/integrator/arkode.h"
#include "mechanism/start/assembly.h"
#include "tests/reference/cases.h"

namespace loopbench::harness::stiff_case_test {

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

/// A shipped planar mechanism with a formulation at its start.
struct Scene {
  explicit Scene(const std::string& name, const Method& method)
      : description(ReadMechanism(kConfigs / "mechanisms" / (name + ".json")).description),
        mechanism(description, method.coordinates),
        system(MakeFormulation<Planar>(method, mechanism)) {
    const Start<double> start = Assemble<Planar>(description, mechanism);
    EXPECT_EQ(system->Start(0.0, start.q, start.u), Outcome::kFinished);
    y.resize(static_cast<std::size_t>(system->state_size()));
    system->ToState(start.q, start.u, y);
  }
  void UseJacobian() {
    system->UseJacobian(std::make_unique<ForwardJacobian<Planar>>(description, *system));
  }

  MechanismDescription description;
  Mechanism<Planar, double> mechanism;
  std::unique_ptr<System<Planar, double>> system;
  std::vector<double> y;
};

const Method kColumn{"odca", Enforcement::kAcceleration, Coordinates::kJoint,
                     SolverKind::kRankRevealing};

TEST(SystemTest, EvaluatesAfreshForAJacobianWhereItHasMovedAway) {
  Scene scene("four-bar", kColumn);
  System<Planar, double>& system = *scene.system;
  scene.UseJacobian();
  const std::size_t n = scene.y.size();
  std::vector<double> ydot(n), elsewhere = scene.y, at_once(n * n), later(n * n), moved(n * n);
  elsewhere[0] += 0.1;
  system.Derivative(0.0, scene.y, ydot);
  EXPECT_EQ(system.Jacobian(0.0, scene.y, at_once).value().derivatives, 0);
  EXPECT_EQ(system.Jacobian(0.0, scene.y, later).value().derivatives, 1);
  EXPECT_EQ(later, at_once);
  EXPECT_EQ(system.Jacobian(0.0, elsewhere, moved).value().derivatives, 1);
  EXPECT_NE(moved, at_once);
  later = moved;
  // an observer evaluates it elsewhere
  system.Derivative(0.0, scene.y, ydot);
  system.Derivative(0.0, elsewhere, ydot);
  EXPECT_EQ(system.Jacobian(0.0, scene.y, later).value().derivatives, 1);
  EXPECT_EQ(later, at_once);
}

TEST(SystemTest, HasNoJacobianUnlessGivenOne) {
  Scene scene("four-bar", kColumn);
  std::vector<double> jacobian(scene.y.size() * scene.y.size());
  EXPECT_FALSE(scene.system->Jacobian(0.0, scene.y, jacobian).has_value());
}

struct Order {
  const char* profile;
  double order, step;
};

/// Largest error of the state after a second, in fixed steps. Newton's iteration leaves a hundredth
/// of 1e-14 in each stage.
double ErrorWithStep(const std::string& profile, double step, const std::vector<double>& exact) {
  Scene scene("four-bar", kColumn);
  scene.UseJacobian();
  IntegratorOptions options;
  options.profile = profile;
  options.rtol = options.atol = 1e-14;
  options.fixed_step = step;
  const IntegratorResult result = Integrate(*scene.system, 0.0, 1.0, scene.y, options);
  EXPECT_EQ(result.outcome, Outcome::kFinished) << result.message;
  EXPECT_EQ(result.jacobian_rhs_evaluations, 0);
  EXPECT_EQ(result.dual_evaluations, result.jacobians);  // six components, eight columns at once
  double error = 0.0;
  for (std::size_t i = 0; i < exact.size(); ++i) {
    error = std::max(error, std::abs(scene.y[i] - exact[i]));
  }
  return error;
}

TEST(SystemTest, ImplicitProfilesHaveTheirOrderWithForwardJacobians) {
  Scene exact("four-bar", kColumn);
  IntegratorOptions options;
  options.profile = "fehlberg-78";
  options.rtol = options.atol = 1e-14;
  ASSERT_EQ(Integrate(*exact.system, 0.0, 1.0, exact.y, options).outcome, Outcome::kFinished);
  for (const Order& one : {Order{"trbdf2", 2, 1.0 / 64},
                           {"kennedy-carpenter-32", 3, 1.0 / 64},
                           {"kennedy-carpenter-43", 4, 1.0 / 32},
                           {"kvaerno-54", 5, 1.0 / 32},
                           {"kennedy-carpenter-54", 5, 1.0 / 16}}) {
    const double coarse = ErrorWithStep(one.profile, one.step, exact.y);
    const double fine = ErrorWithStep(one.profile, one.step / 2, exact.y);
    const double order = std::log2(coarse / fine);
    std::cout << one.profile << ": error " << fine << ", order " << order << "\n";
    EXPECT_GT(fine, 1e-12) << one.profile;  // above round-off, so that there is an order to see
    EXPECT_NEAR(order, one.order, 0.3) << one.profile;  // half-way to the next is 0.5
  }
}

}  // namespace loopbench::harness::stiff_case_test
