// Benchmark A02 through its positions in line, twice a turn: with speeds that satisfy the loops,
// joint coordinates and rank-revealing solvers every formulation stays on the parallel branch,
// where the motion is known in closed form.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <iostream>
#include <limits>
#include <numbers>
#include <vector>

#include "mechanism/description/library.h"
#include "tests/reference/cases.h"
#include "tests/reference/published_numbers.h"
#include "tests/reference/simulate.h"

namespace loopbench::harness::reference {
namespace passages_test {

/// Where the tip of the first crank is at the end: infinitely far if a step met a position in line.
Eigen::Vector3d Tip(int windows, const Method& method, double rtol, double horizon) {
  const MechanismDescription ladder = Ladder(windows, std::numbers::pi / 2, -1.0);
  const Simulation run = Simulate(ladder, method, Options("ode45", rtol), horizon);
  if (run.result.outcome == Outcome::kSingular) {
    return Eigen::Vector3d::Constant(std::numeric_limits<double>::infinity());
  }
  EXPECT_EQ(run.result.outcome, Outcome::kFinished) << run.result.message;
  EXPECT_EQ(run.result.t_reached, horizon);
  const int crank = BodyNamed(ladder, "crank0");
  const Eigen::Vector3d tip = PointOf(ladder, run.last, crank, Eigen::Vector3d::UnitX());
  std::cout << windows << " windows, " << horizon << " s: " << run.result.steps
            << " steps, energy error " << run.energy_error << " J, tip " << tip.transpose() << "\n";
  return tip;
}

class Passages : public testing::TestWithParam<std::string> {
 protected:
  Method method() const {
    return {.formulation = GetParam(),
            .enforcement = Enforcement::kVelocity,
            .coordinates = Coordinates::kJoint,
            .solver = SolverKind::kRankRevealing};
  }
};

/// How near a step comes to a position in line is chance, and with it what is lost there: of 41
/// tolerances around 1e-10 each formulation kept the energy to 1.7e-7 J, which moves the tip by
/// some 1e-7 m, at 23 to 30, and at 2 to 7 it left the branch, which runs mark (warnings_test.cpp).
/// Reduction, whose partition has no pivot in line, ends as `singular` at 2 of 41.
/// Which ones these are, round-off decides. The test is of the median of nine.
TEST_P(Passages, TenOfTheNFourBarOfTwo) {
  std::vector<Eigen::Vector3d> tips;
  for (int k = -4; k <= 4; ++k) tips.push_back(Tip(2, method(), (1.0 + 0.01 * k) * 1e-10, 10.0));
  const PathPoint& end = kA02DerivedN2AtTenSeconds;
  const auto distance = [&](const Eigen::Vector3d& tip) {
    return std::max(std::abs(tip.x() - end.x), std::abs(tip.y() - end.y));
  };
  std::ranges::nth_element(tips, tips.begin() + 4, {}, distance);
  const Eigen::Vector3d& tip = tips[4];
  // at 2 of 41, chance puts 3 or more into nine once in 130 times
  EXPECT_LE(std::ranges::count_if(tips, [](const auto& one) { return !one.allFinite(); }), 2);
  EXPECT_LE(distance(tip), 1e-7) << "890 steps of errors below 1e-10";
  // what EXUDYN's series of step sizes tends to, known to 1e-7
  EXPECT_NEAR(tip.x(), kA02ExudynLimitX, 2e-7);
}

INSTANTIATE_TEST_SUITE_P(Formulations, Passages, testing::Values("odca", "lagrange", "reduction"),
                         [](const auto& test) { return test.param; });

TEST(LongPassages, TwentyOfTheNFourBarOfFortyByOdca) {
  const Method odca{.formulation = "odca",
                    .enforcement = Enforcement::kVelocity,
                    .coordinates = Coordinates::kJoint,
                    .solver = SolverKind::kRankRevealing};
  // ADAMS's file is within 4.1e-6 of the closed form at 20 s; ours adds 700 steps of 1e-8
  const PathPoint& end = kA02PublishedN40At20Seconds;
  const Eigen::Vector3d tip = Tip(40, odca, 1e-8, end.t);
  EXPECT_NEAR(tip.x(), end.x, 4.1e-6 + 7e-6);
  EXPECT_NEAR(tip.y(), end.y, 4.1e-6 + 7e-6);
}

}  // namespace passages_test
}  // namespace loopbench::harness::reference
