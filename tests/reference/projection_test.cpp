// Level projection: loops that stay closed, orders that survive. singular_test.cpp takes it through
// singular positions.
#include "tests/reference/cases.h"
#include "tests/reference/simulate.h"

namespace loopbench::harness::reference::projection_test {

/// Fixed steps against a run with tiny ones.
void ExpectOrders(const Method& method) {
  const MechanismDescription problem = Shipped("four-bar").description;
  for (const auto& [profile, order] : {std::pair{"bogacki-shampine", 3}, {"dormand-prince", 5}}) {
    const auto end = [&](double step) {
      IntegratorOptions options = Options(profile, 1e-3);
      options.fixed_step = step;
      const Simulation run = Simulate(problem, method, options, 1.6);
      EXPECT_EQ(run.result.outcome, Outcome::kFinished);
      return run.last.bodies[2].p;
    };
    const Eigen::Vector3d exact = end(0.0025);
    const double coarse = (end(0.04) - exact).norm(), fine = (end(0.02) - exact).norm();
    // terms of the next order at these steps; the tiny steps' own error is 8^-order of the fine one
    EXPECT_NEAR(std::log2(coarse / fine), order, 0.5) << profile << " " << coarse << " " << fine;
  }
}

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

/// Projection takes away errors of the method's order, and adds none of a lower one.
TEST_P(Projection, KeepsTheOrderOfTheIntegrator) { ExpectOrders(GetParam()); }

INSTANTIATE_TEST_SUITE_P(Methods, Projection, testing::ValuesIn(PositionMethods()), NameOfParam());

// Baumgarte's stabilisation over whole runs: drift that no longer grows, orders that survive.

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
  }
}

/// With given gains: those of the step would change with it.
TEST_P(BaumgarteRun, KeepsTheOrderOfTheIntegrator) {
  Method method = GetParam();
  method.gains = BaumgarteGains{2.0, 2.0};
  ExpectOrders(method);
}

/// Prescribed motions are constraints as others are; a drive in a loop is still followed.
TEST_P(BaumgarteRun, FollowsPrescribedMotions) {
  const Record record = RunShipped("driven-four-bar", GetParam(), 1e-8, 2.0);
  ASSERT_EQ(record.Text("outcome"), "finished") << record.Text("message");
  EXPECT_LE(record.Number("drift_position_max"), 1e-6);
}

INSTANTIATE_TEST_SUITE_P(Methods, BaumgarteRun,
                         testing::ValuesIn(MethodsAt({Enforcement::kBaumgarte})), NameOfParam());

}  // namespace loopbench::harness::reference::projection_test
