// Profiles of the integrator: order of convergence, step counts, determinism, validation.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "harness/integrator/arkode.h"
#include "tests/harness/integrator_problems.h"

namespace loopbench::harness {
using namespace integrator_test;

namespace integrator_test {

class EveryProfile : public testing::TestWithParam<std::string> {};

INSTANTIATE_TEST_SUITE_P(Integrator, EveryProfile, testing::ValuesIn(ProfileNames()),
                         NameOfProfileTest);

double ErrorWithFixedStep(const std::string& profile, double h) {
  TestOde ode = SmoothProblem();
  IntegratorOptions options = WithTolerance(profile, 1e-6);
  options.fixed_step = h;
  State y = SmoothSolution(0);
  EXPECT_EQ(Integrate(ode, 0, 1, y, options).outcome, Outcome::kFinished);
  const State exact = SmoothSolution(1);
  double error = 0;
  for (size_t i = 0; i < y.size(); ++i) {
    error = std::max(error, std::abs(y[i] - exact[i]));
  }
  return error;
}

// Steps are powers of two, so that times are exact. The error must stay far above round-off
// (some 1e-15), hence the longer step for order 8. Observed orders differ from the claimed one by
// the next term of the error: at most 0.14 for the others, 0.46 for order 8 with its long steps.
// Without the hook against the defect of ARKODE 6.4.1, verner has order 2.9 here, fehlberg-78 7.1.
TEST_P(EveryProfile, ConvergesWithItsOrderAtFixedSteps) {
  const int order = OrderOf(GetParam());
  const double h = order == 8 ? 1.0 / 4 : 1.0 / 16;
  const double coarse = ErrorWithFixedStep(GetParam(), h);
  const double fine = ErrorWithFixedStep(GetParam(), h / 2);
  EXPECT_GT(fine, 1e-14);
  EXPECT_NEAR(std::log2(coarse / fine), order, kMaxOrderError);
}

// A tolerance is met in the sense of "global error within 100 times the local tolerance": errors
// of some 30 steps add up and the problem amplifies them by less than e^2. A pair of order 2 takes
// thousands of steps, whose errors add up to more.
TEST_P(EveryProfile, MeetsItsTolerance) {
  TestOde ode = SmoothProblem();
  State y = SmoothSolution(0);
  const IntegratorResult result = Integrate(ode, 0, 1.5, y, WithTolerance(GetParam(), 1e-8));
  EXPECT_EQ(result.outcome, Outcome::kFinished);
  EXPECT_EQ(result.t_reached, 1.5);
  const double bound = OrderOf(GetParam()) == 2 ? 1e-8 * static_cast<double>(result.steps) : 1e-6;
  for (size_t i = 0; i < y.size(); ++i) {
    EXPECT_NEAR(y[i], SmoothSolution(1.5)[i], bound);
  }
}

struct Counts {
  const char* profile;
  double tolerance, steps, rejected, calls;
};

// Released horizontally at rest, 10 s. The rows of ode45 are counts of an independent
// re-implementation of MATLAB's logic; 2 % (and 3 rejected steps) because ARKODE weighs the error
// with |y_n| alone where MATLAB takes the larger of |y_n| and |y_n+1|. The rows of dormand-prince
// are ARKODE 6.4.1 with its defaults; our explicit settings must equal those, up to the few calls
// that its interpolant at the end costs.
TEST(Integrator, StepCountsOnThePendulumAreThoseOfTheProfile) {
  constexpr std::array<Counts, 6> kExpected{{{"ode45", 1e-6, 240, 12, 1514},
                                             {"ode45", 1e-9, 948, 0, 5690},
                                             {"ode45", 1e-12, 3778, 0, 22670},
                                             {"dormand-prince", 1e-6, 219, 23, 1456},
                                             {"dormand-prince", 1e-9, 843, 26, 5218},
                                             {"dormand-prince", 1e-12, 3380, 0, 20282}}};
  for (const Counts& expected : kExpected) {
    TestOde ode = Pendulum();
    State y{1, 0, 0, 0};
    const IntegratorResult result =
        Integrate(ode, 0, 10, y, WithTolerance(expected.profile, expected.tolerance));
    EXPECT_NEAR(static_cast<double>(result.steps), expected.steps, 0.02 * expected.steps)
        << expected.profile;
    EXPECT_NEAR(static_cast<double>(result.rejected), expected.rejected, 3) << expected.profile;
    EXPECT_NEAR(static_cast<double>(result.rhs_evaluations), expected.calls, 0.02 * expected.calls)
        << expected.profile;
    EXPECT_EQ(result.rhs_evaluations, std::ssize(ode.evaluated));
  }
}

TEST_P(EveryProfile, EqualRunsGiveEqualBits) {
  const auto run = [&] {
    TestOde ode = Pendulum();
    State y{1, 0, 0, 0};
    Integrate(ode, 0, 5, y, WithTolerance(GetParam(), 1e-9));
    return y;
  };
  const State first = run(), second = run();
  EXPECT_EQ(std::memcmp(first.data(), second.data(), first.size() * sizeof(double)), 0);
}

TEST(Integrator, MisuseThrows) {
  TestOde ode = Pendulum();
  State y{1, 0, 0};
  EXPECT_THROW(Integrate(ode, 0, 1, y, {}), std::invalid_argument);
  y.push_back(0);
  EXPECT_THROW(Integrate(ode, 1, 0, y, {}), std::invalid_argument);
  IntegratorOptions options;
  options.profile = "ode54";
  EXPECT_THROW(Integrate(ode, 0, 1, y, options), std::invalid_argument);
}

TEST(IntegratorOptions, ValidationNamesTheOptionAndWhatIsAccepted) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const auto fault = [](auto change) {
    IntegratorOptions options;
    change(options);
    return Validate(options);
  };
  EXPECT_EQ(Validate({}), "");
  EXPECT_EQ(fault([](auto& o) { o.profile = "rk4"; }),
            "profile is \"rk4\"; accepted: ode45, dormand-prince, bogacki-shampine, cash-karp, "
            "fehlberg, verner, fehlberg-78, trbdf2, kennedy-carpenter-32, "
            "kennedy-carpenter-43, kvaerno-54, kennedy-carpenter-54, and tables of ARKODE by their "
            "names");
  EXPECT_EQ(fault([](auto& o) { o.rtol = 1e-17; }).substr(0, 4), "rtol");
  EXPECT_EQ(fault([=](auto& o) { o.atol = nan; }).substr(0, 4), "atol");
  EXPECT_EQ(fault([](auto& o) { o.step_limit = 0; }).substr(0, 10), "step_limit");
  EXPECT_EQ(fault([](auto& o) { o.time_limit_s = 0; }).substr(0, 12), "time_limit_s");
  EXPECT_EQ(fault([=](auto& o) { o.atols = {1e-6, nan}; }).substr(0, 5), "atols");
  EXPECT_EQ(fault([](auto& o) { o.profile = "ARKODE_KNOTH_WOLKE_3_3"; }),
            "profile is \"ARKODE_KNOTH_WOLKE_3_3\", which has no embedding; it needs a fixed_step");
  EXPECT_EQ(fault([](auto& o) { o.max_step = -1; }).substr(0, 8), "max_step");
  EXPECT_EQ(fault([=](auto& o) { o.initial_step = nan; }).substr(0, 12), "initial_step");
  EXPECT_EQ(fault([](auto& o) { o.max_newton_iterations = -1; }).substr(0, 21),
            "max_newton_iterations");
  EXPECT_EQ(fault([=](auto& o) { o.newton_coefficient = nan; }).substr(0, 18),
            "newton_coefficient");
  EXPECT_EQ(fault([=](auto& o) { o.fixed_step = nan; }).substr(0, 10), "fixed_step");
}

}  // namespace integrator_test
}  // namespace loopbench::harness
