// Implicit profiles: stability, Newton's iteration and its endings, Jacobians.
#include "tests/harness/integrator_problems.h"

namespace loopbench::harness {
using namespace integrator_test;

namespace integrator_implicit_test {

std::vector<std::string> ImplicitProfiles() {
  std::vector<std::string> names;
  for (const std::string& name : ProfileNames()) {
    if (FindProfile(name)->is_implicit) names.push_back(name);
  }
  return names;
}

class EveryImplicitProfile : public testing::TestWithParam<std::string> {};

INSTANTIATE_TEST_SUITE_P(Integrator, EveryImplicitProfile, testing::ValuesIn(ImplicitProfiles()),
                         NameOfProfileTest);

// |y(1)| after one step of length 1 with y' = z y, y(0) = 1: the modulus of the method's stability
// function at z = re + i im.
double StabilityFunction(const std::string& profile, double re, double im) {
  TestOde ode(2, [=](double, auto y, auto ydot) {
    ydot[0] = re * y[0] - im * y[1];
    ydot[1] = im * y[0] + re * y[1];
  });
  IntegratorOptions options = WithTolerance(profile, 1e-8, 1);
  State y{1, 0};
  const IntegratorResult result = Integrate(ode, 0, 1, y, options);
  EXPECT_EQ(result.outcome, Outcome::kFinished) << result.message;
  EXPECT_EQ(result.steps, 1);
  return std::hypot(y[0], y[1]);
}

// R(z) = O(1/z) for stiff decay, with constants below 20; |R| <= 1 on the imaginary axis, whence by
// the maximum principle in the left half plane. The slack is what Newton may leave, a hundredth of
// the tolerances 1e-8 (|y| + 1) per stage.
TEST_P(EveryImplicitProfile, IsLStable) {
  for (const double z : {1e4, 1e6}) {
    EXPECT_LT(StabilityFunction(GetParam(), -z, 0), 20 / z + 1e-8) << z;
  }
  for (double z = 0.01; z < 1e6; z *= 1.5) {
    EXPECT_LT(StabilityFunction(GetParam(), 0, z), 1 + 1e-8) << z;
  }
}

// J y with eigenvalues -1 and -1e5 in directions (2, 1) and (1, -1) that lie across the components.
// From (3, 0) y_0(t) = 2 e^-t + e^(-1e5 t). A quadrature of y_0 rides along.
TestOde StiffLinear() {
  return TestOde(
      3,
      [](double, auto y, auto ydot) {
        const double slow = (y[0] + y[1]) / 3, fast = (y[0] - 2 * y[1]) / 3;
        ydot[0] = -2 * slow - 1e5 * fast;
        ydot[1] = -slow + 1e5 * fast;
        ydot[2] = y[0];
      },
      1);
}

TEST_P(EveryImplicitProfile, TakesStepsOfTheSlowMotion) {
  const auto run = [](const std::string& profile, double& error) {
    TestOde ode = StiffLinear();
    State y{3, 0, 0};
    const IntegratorResult result = Integrate(ode, 0, 1, y, WithTolerance(profile, 1e-5));
    EXPECT_EQ(result.outcome, Outcome::kFinished) << result.message;
    error =
        std::max(std::abs(y[0] - 2 * std::exp(-1.0)), std::abs(y[2] - 2 * (1 - std::exp(-1.0))));
    return result;
  };
  double error = 0, explicit_error = 0;
  const IntegratorResult implicit = run(GetParam(), error);
  const IntegratorResult dormand_prince = run("dormand-prince", explicit_error);
  EXPECT_LT(error, 1e-3);  // 100 times the tolerance
  EXPECT_LT(100 * implicit.steps, dormand_prince.steps);
  EXPECT_EQ(implicit.newton_failures, 0);
}

TEST_P(EveryImplicitProfile, CountsWhatItDoes) {
  TestOde ode = Pendulum();
  State y{1, 0, 0, 0};
  const IntegratorResult result = Integrate(ode, 0, 1, y, WithTolerance(GetParam(), 1e-6));
  EXPECT_EQ(result.rhs_evaluations + result.jacobian_rhs_evaluations, std::ssize(ode.evaluated));
  EXPECT_GE(result.jacobians, result.steps);
  EXPECT_EQ(result.jacobian_rhs_evaluations, 4 * result.jacobians);
  EXPECT_GT(result.newton_iterations, result.steps);
  EXPECT_GE(result.rhs_evaluations, result.newton_iterations);

  const IntegratorResult none = Integrate(ode, 0, 1, y, WithTolerance("ode45", 1e-6));
  EXPECT_EQ(none.jacobians + none.jacobian_rhs_evaluations + none.newton_iterations +
                none.newton_failures,
            0);
}

// The Jacobian of StiffLinear() by hand, and a switch that makes it wrong.
class WithOwnJacobian : public TestOde {
 public:
  explicit WithOwnJacobian(double factor) : TestOde(StiffLinear()), factor_(factor) {}
  std::optional<JacobianWork> Jacobian(double, std::span<const double>,
                                       std::span<double> jacobian) override {
    const double s = 1.0 / 3, fast = 1e5 / 3;
    const State entries{-2 * s - fast, -s + fast, 1, -2 * s + 2 * fast, -s - 2 * fast, 0};
    EXPECT_EQ(jacobian.size(), entries.size());
    std::transform(entries.begin(), entries.end(), jacobian.begin(),
                   [&](double v) { return factor_ * v; });
    return JacobianWork{.derivatives = 2, .dual_evaluations = 3};
  }

 private:
  double factor_;
};

TEST(IntegratorImplicit, OwnJacobianIsUsedInsteadOfDifferences) {
  const auto run = [](Ode&& ode, State& y) {
    y = {3, 0, 0};
    IntegratorOptions options = WithTolerance("kvaerno-54", 1e-6);
    options.step_limit = 1000;
    return Integrate(ode, 0, 1, y, options);
  };
  State y, y_differences, y_zero;
  const IntegratorResult differences = run(StiffLinear(), y_differences);
  const IntegratorResult own = run(WithOwnJacobian(1), y);
  EXPECT_GT(own.jacobians, 0);
  EXPECT_EQ(own.jacobian_rhs_evaluations, 2 * own.jacobians);
  EXPECT_EQ(own.dual_evaluations, 3 * own.jacobians);
  EXPECT_EQ(own.rhs_evaluations, differences.rhs_evaluations);
  EXPECT_EQ(own.steps, differences.steps);
  EXPECT_EQ(own.outcome, Outcome::kFinished);
  EXPECT_NEAR(y[0], y_differences[0], 1e-7);  // Newton leaves a hundredth of the tolerance per step
  // a Jacobian of zero makes Newton a fixed-point iteration, which cannot converge at long steps
  const IntegratorResult zero = run(WithOwnJacobian(0), y_zero);
  EXPECT_GT(zero.newton_failures, 0);
  EXPECT_NE(zero.outcome, Outcome::kFinished);
}

TEST(IntegratorImplicit, NonFiniteJacobianEndsTheRun) {
  WithOwnJacobian ode(std::numeric_limits<double>::quiet_NaN());
  State y{2, 1, 0};
  const IntegratorResult result = Integrate(ode, 0, 1, y, WithTolerance("trbdf2", 1e-6));
  EXPECT_EQ(result.outcome, Outcome::kNonFinite);
  EXPECT_EQ(y, (State{2, 1, 0}));
}

TEST(IntegratorImplicit, ExceptionsOfTheJacobianPassThrough) {
  class Throws : public TestOde {
   public:
    Throws() : TestOde(StiffLinear()) {}
    std::optional<JacobianWork> Jacobian(double, std::span<const double>,
                                         std::span<double>) override {
      throw std::runtime_error("from the Jacobian");
    }
  } ode;
  State y{2, 1, 0};
  EXPECT_THROW(Integrate(ode, 0, 1, y, WithTolerance("trbdf2", 1e-6)), std::runtime_error);
}

// z = 1 + gamma h z^2 has no real solution for 4 gamma h > 1: with a fixed step of 4 the first
// stage cannot be solved, whatever the profile's gamma (0.18 to 0.44).
TEST_P(EveryImplicitProfile, EquationsWithoutSolutionEndAsNewtonFailure) {
  TestOde ode(1, [](double, auto y, auto ydot) { ydot[0] = y[0] * y[0]; });
  IntegratorOptions options = WithTolerance(GetParam(), 1e-6, 4);
  State y{1};
  testing::internal::CaptureStderr();
  const IntegratorResult result = Integrate(ode, 0, 8, y, options);
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
  EXPECT_EQ(result.outcome, Outcome::kNewtonFailure) << ToString(result.outcome);
  EXPECT_NE(result.message, "");
  EXPECT_EQ(result.newton_failures, 1);
  EXPECT_EQ(result.t_reached, 0);
  EXPECT_EQ(y[0], 1);
}

// A pendulum that turns by 0.2 to 0.5 rad a step: Newton's iteration, with one Jacobian a stage,
// takes more than the few iterations after which a step of variable length would be shortened.
TEST_P(EveryImplicitProfile, LongFixedStepsConverge) {
  for (const double step : {0.02, 0.03, 0.04, 0.05}) {
    TestOde ode = Pendulum();
    IntegratorOptions options = WithTolerance(GetParam(), 1e-9, step);
    State y{1, 0, 0, 10};
    const IntegratorResult result = Integrate(ode, 0, 0.6, y, options);
    EXPECT_EQ(result.outcome, Outcome::kFinished) << step << ": " << result.message;
    EXPECT_EQ(result.newton_failures, 0);
  }
}

// A derivative that fails in a difference quotient, and only there: away from the motion y_1 = 0.
TEST(IntegratorImplicit, FailureInADifferenceQuotientIsTheOutcome) {
  TestOde ode(2, [](double, auto y, auto ydot) {
    ydot[0] = 1;
    ydot[1] = 0;
    return y[1] != 0 ? Outcome::kSingular : Outcome::kFinished;
  });
  State y{0, 0};
  const IntegratorResult result = Integrate(ode, 0, 1, y, WithTolerance("trbdf2", 1e-6));
  EXPECT_EQ(result.outcome, Outcome::kSingular);
  EXPECT_EQ(result.jacobians, 1);
}

// A knot of a table in a stiff problem: y follows g(t) = |t - 1/2| within 1e-6.
TEST_P(EveryImplicitProfile, StopsAtKnotsOfStiffForcing) {
  TestOde ode(1, [](double t, auto y, auto ydot) { ydot[0] = 1e6 * (std::abs(t - 0.5) - y[0]); });
  IntegratorOptions options = WithTolerance(GetParam(), 1e-6);
  options.stop_times = {0.5};
  State y{0.5};
  double worst = 0;
  const IntegratorResult result =
      Integrate(ode, 0, 1, y, options, Watch([&](double t, auto state) {
                  worst = std::max(worst, std::abs(state[0] - std::abs(t - 0.5)));
                }));
  EXPECT_EQ(result.outcome, Outcome::kFinished) << result.message;
  EXPECT_LT(worst, 1e-4);  // 100 times the tolerance
  EXPECT_LT(result.steps, 1000);
}

}  // namespace integrator_implicit_test
}  // namespace loopbench::harness
