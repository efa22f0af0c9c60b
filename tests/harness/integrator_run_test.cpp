// One run of the integrator: named endings, what observers see, restarts.
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <span>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "harness/base/text.h"
#include "harness/integrator/arkode.h"
#include "tests/harness/integrator_problems.h"

namespace loopbench::harness {
using namespace integrator_test;

namespace integrator_run_test {

class EveryProfileRun : public testing::TestWithParam<std::string> {};

INSTANTIATE_TEST_SUITE_P(Integrator, EveryProfileRun, testing::ValuesIn(ProfileNames()),
                         NameOfProfileTest);

// y' = 1 until t = 0.5, where `failure` happens.
TestOde FailsAtHalf(double value, Outcome failure) {
  return TestOde(1, [=](double t, auto, auto ydot) {
    ydot[0] = t < 0.5 ? 1 : value;
    return t < 0.5 ? Outcome::kFinished : failure;
  });
}

void ExpectEndingAtHalf(TestOde ode, Outcome outcome) {
  State y{0};
  State last;
  double t_last = -1;
  IntegratorOptions options;
  options.max_step = 0.01;
  testing::internal::CaptureStderr();
  const IntegratorResult result = Integrate(ode, 0, 1, y, options, [&](double t, auto state) {
    t_last = t;
    last.assign(state.begin(), state.end());
    return StepAction::kContinue;
  });
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "") << "SUNDIALS wrote to stderr";
  EXPECT_EQ(result.outcome, outcome) << ToString(result.outcome);
  EXPECT_NE(result.message, "");
  EXPECT_LT(result.t_reached, 0.5);
  EXPECT_GE(result.t_reached, 0.48);  // two longest steps before the fault
  EXPECT_EQ(result.t_reached, t_last);
  EXPECT_EQ(y, last) << "after a failure the state is the last accepted one";
}

TEST(IntegratorRun, NonFiniteDerivativeEndsTheRun) {
  for (const double value :
       {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    ExpectEndingAtHalf(FailsAtHalf(value, Outcome::kFinished), Outcome::kNonFinite);
  }
}

TEST(IntegratorRun, FailureOfTheDerivativeIsTheOutcome) {
  ExpectEndingAtHalf(FailsAtHalf(1, Outcome::kSingular), Outcome::kSingular);
}

TEST(IntegratorRun, FailureAtTheStartLeavesTheStartState) {
  for (const std::string& profile : ProfileNames()) {
    // Fails everywhere but at the start point, so that ARKODE's own first-step search meets it too.
    TestOde ode(1, [](double t, auto, auto ydot) {
      ydot[0] = 1;
      return t > 0 ? Outcome::kSingular : Outcome::kFinished;
    });
    State y{3};
    const IntegratorResult result = Integrate(ode, 0, 1, y, WithTolerance(profile, 1e-6));
    EXPECT_EQ(result.outcome, Outcome::kSingular) << profile;
    EXPECT_EQ(result.t_reached, 0);
    EXPECT_EQ(result.steps, 0);
    EXPECT_EQ(y, State{3});
  }
}

TEST(IntegratorRun, StepLimitEndsTheRun) {
  TestOde ode = Pendulum();
  State y{1, 0, 0, 0};
  IntegratorOptions options;
  options.step_limit = 7;
  const IntegratorResult result = Integrate(ode, 0, 10, y, options);
  EXPECT_EQ(result.outcome, Outcome::kStepLimit);
  EXPECT_EQ(result.steps, 7);
}

// A derivative that computes for 2 ms.
TEST(IntegratorRun, TimeLimitEndsTheRun) {
  TestOde ode(1, [](double, auto, auto ydot) {
    const double begin = ThreadCpuSeconds();
    while (ThreadCpuSeconds() < begin + 2e-3) {
    }
    ydot[0] = 1;
    return Outcome::kFinished;
  });
  State y{0};
  IntegratorOptions options;
  options.max_step = 1e-3;  // a thousand steps, 12 s
  options.time_limit_s = 0.05;
  const IntegratorResult result = Integrate(ode, 0, 1, y, options);
  EXPECT_EQ(result.outcome, Outcome::kTimeLimit);
  EXPECT_GE(result.cpu_s, 0.05);
  EXPECT_GE(result.wall_s, result.cpu_s);
  EXPECT_LT(result.cpu_s, 0.15);  // 16 calls of 2 ms, and as much again
}

// Whatever keeps the thread from computing, a loaded machine or a stop, is not its doing: a run
// that takes ten times its limit on the wall, asleep, finishes.
TEST(IntegratorRun, TimeLimitDoesNotCountWaiting) {
  TestOde ode(1, [](double, auto, auto ydot) {
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
    ydot[0] = 1;
    return Outcome::kFinished;
  });
  State y{0};
  IntegratorOptions options;
  options.max_step = 0.1;  // ten steps, 60 derivatives
  options.time_limit_s = 0.06;
  const IntegratorResult result = Integrate(ode, 0, 1, y, options);
  EXPECT_EQ(result.outcome, Outcome::kFinished);
  EXPECT_GE(result.wall_s, 0.6);
  EXPECT_LT(result.cpu_s, 0.06);
}

TEST(CpuLimit, IsReachedByComputingAlone) {
  CpuLimit limit(0.05);
  std::this_thread::sleep_for(std::chrono::milliseconds(100));
  EXPECT_FALSE(limit.Reached());
  while (!limit.Reached()) {
  }
  EXPECT_GE(limit.cpu_s(), 0.05);
  EXPECT_LT(limit.cpu_s(), 0.1) << "it looks again no later than it could be reached";
}

// y' = y^2 from 1 is 1 / (1 - t): steps shrink in proportion to the time left.
TEST(IntegratorRun, BlowUpIsStepTooSmall) {
  TestOde ode(1, [](double, auto y, auto ydot) {
    ydot[0] = y[0] * y[0];
    return Outcome::kFinished;
  });
  State y{1};
  const IntegratorResult result = Integrate(ode, 0, 2, y, IntegratorOptions{});
  EXPECT_EQ(result.outcome, Outcome::kStepTooSmall) << ToString(result.outcome);
  EXPECT_NEAR(result.t_reached, 1, 1e-6);
}

// From t = 0.5 on the derivative is noise of size 1e30: seven reductions of one step, by a factor
// of ten at most, do not bring its error below the tolerance, and ARKODE gives up (its code -3).
TEST(IntegratorRun, RepeatedErrorTestFailureIsStepTooSmall) {
  double sign = 1;
  TestOde ode(1, [&](double t, auto, auto ydot) {
    sign = -sign;
    ydot[0] = t < 0.5 ? 1 : 1e30 * sign;
    return Outcome::kFinished;
  });
  State y{0};
  IntegratorOptions options;
  options.max_step = 0.01;
  testing::internal::CaptureStderr();
  const IntegratorResult result = Integrate(ode, 0.495, 1, y, options);
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
  EXPECT_EQ(result.outcome, Outcome::kStepTooSmall) << ToString(result.outcome);
  EXPECT_NE(result.message, "");
}

TEST(IntegratorRun, ReturnCodesMapToOutcomes) {
  const std::vector<std::pair<int, Outcome>> table{
      {0, Outcome::kFinished},          {1, Outcome::kFinished},
      {99, Outcome::kFinished},         {-1, Outcome::kStepLimit},
      {-2, Outcome::kIntegratorError},  {-3, Outcome::kStepTooSmall},
      {-4, Outcome::kNewtonFailure},    {-8, Outcome::kIntegratorError},
      {-9, Outcome::kIntegratorError},  {-10, Outcome::kIntegratorError},
      {-11, Outcome::kIntegratorError}, {-22, Outcome::kIntegratorError},
      {-27, Outcome::kIntegratorError}, {-99, Outcome::kIntegratorError}};
  for (const auto& [code, outcome] : table) {
    EXPECT_EQ(OutcomeOfReturnCode(code), outcome) << code;
  }
}

// Interpolated points are never arguments of the derivative; accepted steps all are, because the
// next step starts with f there. For the last one see the next test.
TEST_P(EveryProfileRun, ObserversSeeAcceptedStepsOnly) {
  TestOde ode = Pendulum();
  State y{1, 0, 0, 0};
  std::vector<std::pair<double, State>> seen;
  const IntegratorResult result =
      Integrate(ode, 0, 1, y, WithTolerance(GetParam(), 1e-6), [&](double t, auto state) {
        seen.emplace_back(t, State(state.begin(), state.end()));
        return StepAction::kContinue;
      });
  ASSERT_EQ(std::ssize(seen), result.steps + 1);
  EXPECT_EQ(seen.front().first, 0);
  EXPECT_EQ(seen.back().first, 1);
  EXPECT_EQ(seen.back().second, y);
  for (size_t i = 0; i + 1 < seen.size(); ++i) {
    EXPECT_NE(std::find(ode.evaluated.begin(), ode.evaluated.end(), seen[i]), ode.evaluated.end())
        << "step " << i << " at " << seen[i].first;
  }
}

// Steps of 1/16 are exact in time, so both runs take the same steps up to t = 1, where one ends.
TEST_P(EveryProfileRun, FinalStateIsAStepsOwnEnd) {
  IntegratorOptions options = WithTolerance(GetParam(), 1e-6);
  options.fixed_step = 1.0 / 16;
  State on_the_way;
  State y{1, 0, 0, 0};
  TestOde ode = Pendulum();
  Integrate(ode, 0, 2, y, options, [&](double t, auto state) {
    if (t == 1) on_the_way.assign(state.begin(), state.end());
    return StepAction::kContinue;
  });
  State at_the_end{1, 0, 0, 0};
  Integrate(ode, 0, 1, at_the_end, options);
  EXPECT_EQ(at_the_end, on_the_way);
}

TEST(IntegratorRun, ChangesOfTheStateWithoutRestartAreIgnored) {
  const auto run = [](bool spoil) {
    TestOde ode = Pendulum();
    State y{1, 0, 0, 0};
    Integrate(ode, 0, 1, y, {}, [&](double t, std::span<double> state) {
      if (spoil && t > 0 && t < 1) state[0] = 7;
      return StepAction::kContinue;
    });
    return y;
  };
  EXPECT_EQ(run(true), run(false));
}

// Restarting with the same state costs one derivative and changes nothing else: the step size and
// the controller survive, and f(t, y) is the same number.
TEST_P(EveryProfileRun, RestartWithUnchangedStateKeepsSteps) {
  const auto run = [&](StepAction action) {
    TestOde ode = Pendulum();
    State y{1, 0, 0, 0};
    const IntegratorResult result = Integrate(ode, 0, 2, y, WithTolerance(GetParam(), 1e-8),
                                              [=](double, auto) { return action; });
    return std::pair(result, y);
  };
  const auto [plain, y_plain] = run(StepAction::kContinue);
  const auto [restarted, y_restarted] = run(StepAction::kRestart);
  if (FindProfile(GetParam())->is_implicit) {
    // Newton starts from another prediction and leaves another hundredth of the tolerance
    EXPECT_NEAR(static_cast<double>(restarted.steps), static_cast<double>(plain.steps),
                0.02 * static_cast<double>(plain.steps));
    EXPECT_EQ(restarted.restarts, restarted.steps - 1);
    EXPECT_NEAR(y_restarted[0], y_plain[0], 1e-6);
    return;
  }
  EXPECT_EQ(restarted.steps, plain.steps);
  EXPECT_EQ(restarted.rejected, plain.rejected);
  EXPECT_EQ(plain.restarts, 0);
  EXPECT_EQ(restarted.restarts, plain.steps - 1);  // not at the start, not at the end
  EXPECT_EQ(y_restarted, y_plain);
}

// The state is scaled by two, half way and with fixed steps: y' = -y has the solution 2 e^-t.
TEST_P(EveryProfileRun, RestartWithAChangedStateKeepsOrder) {
  const auto error = [&](double h) {
    TestOde ode(1, [](double, auto y, auto ydot) {
      ydot[0] = -y[0];
      return Outcome::kFinished;
    });
    IntegratorOptions options = WithTolerance(GetParam(), 1e-6);
    options.fixed_step = h;
    State y{1};
    Integrate(ode, 0, 2, y, options, [](double t, std::span<double> state) {
      if (t != 1) return StepAction::kContinue;
      state[0] *= 2;
      return StepAction::kRestart;
    });
    return std::abs(y[0] - 2 * std::exp(-2.0));
  };
  const double h = OrderOf(GetParam()) == 8 ? 0.5 : 0.125;
  EXPECT_NEAR(std::log2(error(h) / error(h / 2)), OrderOf(GetParam()), kMaxOrderError);
}

TEST(IntegratorRun, ObserverCanStopTheRun) {
  TestOde ode = Pendulum();
  State y{1, 0, 0, 0};
  const IntegratorResult result = Integrate(ode, 0, 10, y, {}, [](double t, auto) {
    return t > 1 ? StepAction::kStop : StepAction::kContinue;
  });
  EXPECT_EQ(result.outcome, Outcome::kFinished);
  EXPECT_GT(result.t_reached, 1);
  EXPECT_LT(result.t_reached, 1.5);
  EXPECT_NE(result.message, "");
}

TEST(IntegratorRun, FixedStepsClipTheLast) {
  TestOde ode = SmoothProblem();
  State y = SmoothSolution(0);
  IntegratorOptions options;
  options.fixed_step = 0.3;
  const IntegratorResult result = Integrate(ode, 0, 1, y, options);
  EXPECT_EQ(result.steps, 4);
  EXPECT_EQ(result.t_reached, 1);
  EXPECT_NEAR(result.last_step, 0.1, 1e-15);
}

TEST(IntegratorRun, ExceptionsPassThrough) {
  TestOde ode(1, [](double t, auto, auto ydot) {
    ydot[0] = 1;
    if (t > 0.5) throw std::runtime_error("from the derivative");
    return Outcome::kFinished;
  });
  State y{0};
  EXPECT_THROW(Integrate(ode, 0, 1, y, IntegratorOptions{}), std::runtime_error);
}

TEST(IntegratorRun, EmptyIntervalIsFinishedAtOnce) {
  TestOde ode = Pendulum();
  State y{1, 0, 0, 0};
  int seen = 0;
  const IntegratorResult result = Integrate(ode, 2, 2, y, {}, [&](double, auto) {
    ++seen;
    return StepAction::kContinue;
  });
  EXPECT_EQ(result.outcome, Outcome::kFinished);
  EXPECT_EQ(result.t_reached, 2);
  EXPECT_EQ(seen, 1);
}

}  // namespace integrator_run_test
}  // namespace loopbench::harness
