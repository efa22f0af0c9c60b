// Stop times: steps that end where the derivative jumps, and what is evaluated on which side.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include "harness/integrator/arkode.h"
#include "tests/harness/integrator_problems.h"

namespace loopbench::harness {
using namespace integrator_test;

namespace integrator_stops_test {

// On grids of steps 4^-k a knot at two thirds has the same place within its step for every k.
constexpr double kKnot = 2.0 / 3;
constexpr double kRate = 4;  // fast enough for an order of 8 to show before round-off

// y' = -rate y + 3 g(t - knot) with g(s) = s^power for s >= 0, else 0: f jumps for power 0, has a
// kink for power 1. From the right: g(0) = 1 for power 0.
TestOde Forced(int power) {
  return TestOde(1, [power](double t, auto y, auto ydot) {
    const double s = t - kKnot;
    ydot[0] = -kRate * y[0] + (s < 0 ? 0 : 3 * std::pow(s, power));
    return Outcome::kFinished;
  });
}
double ForcedSolution(int power, double t) {
  const double s = std::max(0.0, kRate * (t - kKnot)), rise = 1 - std::exp(-s);
  return std::exp(-kRate * t) + 3 / kRate * (power == 0 ? rise : (s - rise) / kRate);
}

class EveryProfileStop : public testing::TestWithParam<std::string> {};

INSTANTIATE_TEST_SUITE_P(Integrator, EveryProfileStop, testing::ValuesIn(ProfileNames()),
                         NameOfProfileTest);

double ObservedOrder(const std::string& profile, int power, bool with_stop) {
  const auto error = [&](double h) {
    TestOde ode = Forced(power);
    IntegratorOptions options = WithTolerance(profile, 1e-12);
    options.fixed_step = h;
    if (with_stop) options.stop_times = {kKnot};
    State y{1};
    EXPECT_EQ(Integrate(ode, 0, 1, y, options).outcome, Outcome::kFinished);
    return std::abs(y[0] - ForcedSolution(power, 1));
  };
  double h = OrderOf(profile) == 8 ? 1.0 / 4 : 1.0 / 16;
  if (!with_stop) h /= 16;  // the error at the knot must outweigh that of the smooth parts
  return std::log2(error(h) / error(h / 4)) / 2;
}

// With the knot at a stop time the order is that of the pair. Across the knot one step has an error
// of the jump times h (power 0) or h^2 (power 1): first and second order, whatever the pair.
TEST_P(EveryProfileStop, KeepTheOrderAcrossAJumpAndAKink) {
  const int order = OrderOf(GetParam());
  EXPECT_NEAR(ObservedOrder(GetParam(), 0, true), order, kMaxOrderError);
  EXPECT_NEAR(ObservedOrder(GetParam(), 1, true), order, kMaxOrderError);
  EXPECT_LT(ObservedOrder(GetParam(), 0, false), 1.5);
  EXPECT_LT(ObservedOrder(GetParam(), 1, false), 2.5);
}

// With the error test on: a tolerance is met as on a smooth problem, and the knots are step ends.
TEST_P(EveryProfileStop, AreStepEndsAndSplitTheEvaluations) {
  for (const double tolerance : {1e-4, 1e-9}) {
    TestOde ode = Forced(0);
    IntegratorOptions options = WithTolerance(GetParam(), tolerance);
    options.stop_times = {kKnot, 0.7, 0.70001};
    State y{1};
    std::vector<double> seen;
    const IntegratorResult result = Integrate(ode, 0, 1, y, options, [&](double t, auto) {
      seen.push_back(t);
      for (const auto& [evaluated, state] : ode.evaluated) {
        if (t == kKnot) {
          EXPECT_LT(evaluated, kKnot);
        } else if (t > kKnot) {
          EXPECT_GE(evaluated, kKnot);
        }
      }
      if (t >= kKnot) ode.evaluated.clear();
      return StepAction::kContinue;
    });
    EXPECT_EQ(result.outcome, Outcome::kFinished) << result.message;
    EXPECT_EQ(result.restarts, 0) << "stops are not restarts of the observer";
    for (const double stop : options.stop_times) {
      EXPECT_EQ(std::count(seen.begin(), seen.end(), stop), 1) << stop;
    }
    EXPECT_TRUE(std::is_sorted(seen.begin(), seen.end()));
    EXPECT_NEAR(y[0], ForcedSolution(0, 1), 100 * tolerance);
  }
}

// The second of two close stops clips a step to almost nothing. The one after it has the old length
// again, instead of growing from there by a factor of 5 to 25 per step.
TEST_P(EveryProfileStop, KeepTheStepLength) {
  TestOde ode = Pendulum();
  IntegratorOptions options = WithTolerance(GetParam(), 1e-9);
  options.stop_times = {1, 1 + 1e-9};
  State y{1, 0, 0, 0};
  std::vector<double> ends;
  Integrate(ode, 0, 2, y, options, [&](double t, auto) {
    ends.push_back(t);
    return StepAction::kContinue;
  });
  const auto stop = std::find(ends.begin(), ends.end(), 1.0);
  ASSERT_GT(stop - ends.begin(), 2);
  ASSERT_EQ(stop[1], 1 + 1e-9);
  const double before = stop[-1] - stop[-2];  // the step that ends at 1 may be clipped itself
  EXPECT_GT(stop[2] - stop[1], 0.5 * before);
}

// Nothing to stop at within the run, and a right-hand side without time: the same bits.
TEST_P(EveryProfileStop, OutsideTheRunHaveNoEffect) {
  const auto run = [&](const std::vector<double>& stops) {
    TestOde ode = Pendulum();
    IntegratorOptions options = WithTolerance(GetParam(), 1e-8);
    options.stop_times = stops;
    State y{1, 0, 0, 0};
    const IntegratorResult result = Integrate(ode, 1, 2, y, options);
    y.push_back(static_cast<double>(result.rhs_evaluations));
    return y;
  };
  EXPECT_EQ(run({}), run({-3, 0, 1, 1, 1 + 1e-15, 2 - 1e-15, 2, 2, 7}));
}

TEST(IntegratorStops, AtTheEndHideWhatComesAfterIt) {
  for (const std::string& profile : ProfileNames()) {
    TestOde ode(1, [](double t, auto, auto ydot) {
      ydot[0] = t < 1 ? 0 : 1;
      return Outcome::kFinished;
    });
    IntegratorOptions options = WithTolerance(profile, 1e-6);
    options.stop_times = {1};
    State y{0};
    Integrate(ode, 0, 1, y, options);
    EXPECT_EQ(y[0], 0) << profile;
  }
}

// Stops closer together than the error test would ever step, and one within round-off of another.
TEST(IntegratorStops, MayBeDense) {
  TestOde ode = Forced(0);
  IntegratorOptions options = WithTolerance("ode45", 1e-6);
  for (int i = 1; i <= 300; ++i) options.stop_times.push_back(i / 300.0);
  options.stop_times.push_back(std::nextafter(1.0, 2.0));
  options.stop_times.insert(options.stop_times.begin() + 100,
                            std::nextafter(options.stop_times[99], 2.0));
  State y{1};
  const IntegratorResult result = Integrate(ode, 0, 1, y, options);
  EXPECT_EQ(result.outcome, Outcome::kFinished) << result.message;
  EXPECT_EQ(result.steps, 300);
  EXPECT_EQ(result.rejected, 0);
}

// The observer restarts at every step, stop times included: the next step starts from its state.
TEST_P(EveryProfileStop, GoTogetherWithRestarts) {
  TestOde ode = Forced(0);
  IntegratorOptions options = WithTolerance(GetParam(), 1e-9);
  options.stop_times = {kKnot};
  State y{1};
  const IntegratorResult result =
      Integrate(ode, 0, 1, y, options, [](double t, std::span<double> state) {
        if (t == kKnot) state[0] += 1;
        return StepAction::kRestart;
      });
  EXPECT_EQ(result.outcome, Outcome::kFinished);
  EXPECT_NEAR(y[0], ForcedSolution(0, 1) + std::exp(kRate * (kKnot - 1)), 1e-7);
}

TEST(IntegratorStops, OutOfOrderOrNotFiniteAreRefused) {
  IntegratorOptions options;
  options.stop_times = {0, 1, 0.5};
  EXPECT_EQ(Validate(options), "stop_times[2] is 0.500000; stop times must be finite and in order");
  options.stop_times = {std::numeric_limits<double>::quiet_NaN()};
  TestOde ode = Pendulum();
  State y{1, 0, 0, 0};
  EXPECT_THROW(Integrate(ode, 0, 1, y, options), std::invalid_argument);
}

}  // namespace integrator_stops_test
}  // namespace loopbench::harness
