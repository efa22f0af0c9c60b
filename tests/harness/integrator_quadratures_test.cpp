// Quadratures: components that ride along without a say in the steps.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "harness/integrator/arkode.h"
#include "tests/harness/integrator_problems.h"

namespace loopbench::harness {
using namespace integrator_test;

namespace integrator_quadratures_test {

class EveryProfileQuadrature : public testing::TestWithParam<std::string> {};

INSTANTIATE_TEST_SUITE_P(Integrator, EveryProfileQuadrature, testing::ValuesIn(ProfileNames()),
                         NameOfProfileTest);

// The pendulum with `count` quadratures, each of a size and roughness that would rule the steps if
// it were asked: 1e9 times the speed, and its sign.
TestOde PendulumWith(int count) {
  return TestOde(
      4 + count,
      [count](double t, auto y, auto ydot) {
        TestOde pendulum = Pendulum();
        pendulum.Derivative(t, y.first(4), ydot.first(4));
        for (int i = 0; i < count; ++i) {
          ydot[4 + i] = 1e9 * y[2] + (y[2] > 0 ? 1e9 : -1e9);
        }
        return Outcome::kFinished;
      },
      count);
}

// Every accepted step's time and state, without quadratures.
std::vector<State> StepsOfPendulum(const std::string& profile, int count) {
  TestOde ode = PendulumWith(count);
  State y(4 + count, 0.0);
  y[0] = 1;
  std::vector<State> steps;
  const IntegratorResult result =
      Integrate(ode, 0, 3, y, WithTolerance(profile, 1e-7), [&](double t, auto state) {
        steps.emplace_back(state.begin(), state.begin() + 4);
        steps.back().push_back(t);
        return StepAction::kContinue;
      });
  EXPECT_EQ(result.outcome, Outcome::kFinished) << result.message;
  steps.push_back({static_cast<double>(result.rejected),
                   static_cast<double>(result.rhs_evaluations), result.last_step});
  return steps;
}

TEST_P(EveryProfileQuadrature, LeaveTheStepsAndTheOtherBitsAlone) {
  const std::vector<State> without = StepsOfPendulum(GetParam(), 0);
  for (const int count : {1, 2, 7}) {
    EXPECT_EQ(StepsOfPendulum(GetParam(), count), without) << count;
  }
}

// The test above can fail: as ordinary components they change the steps.
TEST(IntegratorQuadratures, AsOrdinaryComponentsWouldChangeTheSteps) {
  TestOde with = PendulumWith(1);
  TestOde ordinary(5, [&](double t, auto y, auto ydot) { return with.Derivative(t, y, ydot); });
  State y{1, 0, 0, 0, 0}, z{1, 0, 0, 0, 0};
  const auto options = WithTolerance("dormand-prince", 1e-7);
  EXPECT_NE(Integrate(with, 0, 3, y, options).steps, Integrate(ordinary, 0, 3, z, options).steps);
}

// Along the smooth problem y_1^2 = cos^2 t and y_3 = 1 / (1 + t^2) have known integrals; two,
// because the error of one may change its sign with the step. Steps as in the test of the profiles'
// order.
TEST_P(EveryProfileQuadrature, ConvergeWithTheOrderOfThePair) {
  const auto error = [&](double h) {
    TestOde ode(
        6,
        [](double t, auto y, auto ydot) {
          TestOde smooth = SmoothProblem();
          smooth.Derivative(t, y.first(4), ydot.first(4));
          ydot[4] = y[1] * y[1];
          ydot[5] = y[3];
          return Outcome::kFinished;
        },
        2);
    IntegratorOptions options = WithTolerance(GetParam(), 1e-13);
    options.fixed_step = h;
    State y = SmoothSolution(0);
    y.resize(6, 0.0);
    Integrate(ode, 0, 1, y, options);
    return std::max(std::abs(y[4] - (0.5 + std::sin(2.0) / 4)), std::abs(y[5] - std::atan(1.0)));
  };
  const double h = OrderOf(GetParam()) == 8 ? 1.0 / 4 : 1.0 / 16;
  const double coarse = error(h), fine = error(h / 2);
  EXPECT_GT(fine, 1e-14);
  EXPECT_NEAR(std::log2(coarse / fine), OrderOf(GetParam()), kMaxOrderError);
}

TEST(IntegratorQuadratures, MustLeaveAComponentToControl) {
  TestOde ode(
      1, [](double, auto, auto) { return Outcome::kFinished; }, 1);
  State y{0};
  EXPECT_THROW(Integrate(ode, 0, 1, y, {}), std::invalid_argument);
}

}  // namespace integrator_quadratures_test
}  // namespace loopbench::harness
