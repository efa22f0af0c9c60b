// Baumgarte's stabilisation over whole runs: drift that no longer grows, orders that survive.
#include <gtest/gtest.h>

#include <cmath>
#include <iostream>

#include "tests/reference/cases.h"
#include "tests/reference/simulate.h"

namespace loopbench::harness::reference {
namespace baumgarte_test {

std::vector<Method> Methods() {
  std::vector<Method> methods = PositionMethods();
  for (Method& method : methods) method.enforcement = Enforcement::kBaumgarte;
  return methods;
}

class BaumgarteRun : public testing::TestWithParam<Method> {};

/// Without feedback drift grows with the square of time: four times the horizon, sixteen times the
/// drift. With it, what is fed in per step decays within some steps.
TEST_P(BaumgarteRun, DriftStopsGrowing) {
  Method plain = GetParam();
  plain.enforcement = Enforcement::kAcceleration;
  for (const double tolerance : {1e-6, 1e-9}) {
    const auto drift = [&](const Method& method, double horizon) {
      const Record record = RunShipped("four-bar", method, tolerance, horizon);
      EXPECT_EQ(record.Text("outcome"), "finished") << record.Text("message");
      return record.Number("drift_position_max");
    };
    const double early = drift(GetParam(), 10.0), late = drift(GetParam(), 40.0);
    const double unstabilised = drift(plain, 40.0);
    EXPECT_LE(late, 2 * early) << tolerance;
    EXPECT_LE(late, 0.01 * unstabilised) << tolerance;
    std::cout << tolerance << ": " << early << ", " << late << ", without " << unstabilised << "\n";
  }
}

/// Fixed steps against a run with tiny ones. Gains given: those of the step would change with it.
TEST_P(BaumgarteRun, KeepsTheOrderOfTheIntegrator) {
  const MechanismDescription problem = Shipped("four-bar").description;
  Method method = GetParam();
  method.gains = BaumgarteGains{2.0, 2.0};
  for (const auto& [profile, order] : {std::pair{"bogacki-shampine", 3}, {"dormand-prince", 5}}) {
    const auto end = [&](double step) {
      IntegratorOptions options = Options(profile, 1e-3);
      options.fixed_step = step;
      const Simulation run = Simulate(problem, method, options, 1.6, {});
      EXPECT_EQ(run.result.outcome, Outcome::kFinished);
      return run.last.bodies[2].p;
    };
    const Eigen::Vector3d exact = end(0.0025);
    const double coarse = (end(0.04) - exact).norm(), fine = (end(0.02) - exact).norm();
    // terms of the next order at these steps; the tiny steps' own error is 8^-order of the fine one
    EXPECT_NEAR(std::log2(coarse / fine), order, 0.5) << profile << " " << coarse << " " << fine;
  }
}

/// Prescribed motions are constraints as others are; a drive in a loop is still followed.
TEST_P(BaumgarteRun, FollowsPrescribedMotions) {
  const Record record = RunShipped("driven-four-bar", GetParam(), 1e-8, 2.0);
  ASSERT_EQ(record.Text("outcome"), "finished") << record.Text("message");
  EXPECT_LE(record.Number("drift_position_max"), 1e-6);
}

INSTANTIATE_TEST_SUITE_P(Methods, BaumgarteRun, testing::ValuesIn(Methods()),
                         [](const auto& test) { return NameOf(test.param); });

}  // namespace baumgarte_test
}  // namespace loopbench::harness::reference
