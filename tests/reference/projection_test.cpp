// Level projection: loops that stay closed, orders that survive. singular_test.cpp takes it through
// singular positions.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/reference/cases.h"
#include "tests/reference/simulate.h"

namespace loopbench::harness::reference {
namespace projection_test {

class Projection : public testing::TestWithParam<Method> {};

TEST_P(Projection, KeepsLoopsClosedWhateverTheTolerance) {
  for (const char* name : {"four-bar", "seven-bar", "slider-crank", "spatial-four-bar"}) {
    for (const double tolerance : {1e-4, 1e-8}) {
      const Record record = RunShipped(name, GetParam(), tolerance, 5.0);
      ASSERT_EQ(record.Text("outcome"), "finished") << name << ": " << record.Text("message");
      // round-off of poses of some metres that go through seven bodies at most
      EXPECT_LE(record.Number("drift_position_max"), 1e-14) << name;
      EXPECT_GT(record.Number("correction_max"), 0.0) << name;
      EXPECT_LE(record.Number("correction_max"), 10 * tolerance) << name << ": a step's error";
    }
  }
}

/// Fixed steps against a run with tiny ones: projection takes away errors of the method's order,
/// and adds none of a lower one.
TEST_P(Projection, KeepsTheOrderOfTheIntegrator) {
  const MechanismDescription problem = Shipped("four-bar").description;
  for (const auto& [profile, order] : {std::pair{"bogacki-shampine", 3}, {"dormand-prince", 5}}) {
    const auto end = [&](double step) {
      IntegratorOptions options = Options(profile, 1e-3);
      options.fixed_step = step;
      const Simulation run = Simulate(problem, GetParam(), options, 1.6, {});
      EXPECT_EQ(run.result.outcome, Outcome::kFinished);
      return run.last.bodies[2].p;
    };
    const Eigen::Vector3d exact = end(0.0025);
    const double coarse = (end(0.04) - exact).norm(), fine = (end(0.02) - exact).norm();
    // terms of the next order at these steps; the tiny steps' own error is 8^-order of the fine one
    EXPECT_NEAR(std::log2(coarse / fine), order, 0.5) << profile << " " << coarse << " " << fine;
  }
}

INSTANTIATE_TEST_SUITE_P(Methods, Projection, testing::ValuesIn(PositionMethods()),
                         [](const auto& test) { return NameOf(test.param); });

}  // namespace projection_test
}  // namespace loopbench::harness::reference
