// How drift grows, and what it follows: the formulation, the level, the coordinates or the
// geometry.
#include "tests/reference/cases.h"

namespace loopbench::harness::reference::exponents_test {

/// Eight perturbed starts of the four-bar (ground 1.5 m), whose closure is no linear invariant.
Record GeneralFourBar(const std::string& formulation) {
  Case one = CaseOf(Paper(), "four-bar", Published(formulation, Coordinates::kJoint), 1e-8, 50.0);
  one.ensemble = 8;
  one.seed = 1;
  one.perturb = 0.02;
  return RunCase(Paper(), one);
}

void ExpectExponent(const Record& record, double exponent) {
  EXPECT_EQ(record.Text("growth_resolved"), "true");
  EXPECT_EQ(record.Text("growth_regime"), "truncation");
  EXPECT_EQ(record.Number("ensemble_failed"), 0);
  EXPECT_NEAR(record.Number("growth_exponent"), exponent, 0.15);
  EXPECT_EQ(record.Text("growth_hypothesis"), exponent == 2.0 ? "t^2" : "t^1");
  EXPECT_EQ(record.Text("growth_hypothesis_resolved"), "true");
}

TEST(DriftOfTheGeneralFourBar, GrowsQuadraticallyAtAccelerationLevel) {
  ExpectExponent(GeneralFourBar("odca"), 2.0);
  ExpectExponent(GeneralFourBar("lagrange"), 2.0);
}

TEST(DriftOfTheGeneralFourBar, GrowsLinearlyAtVelocityLevel) {
  ExpectExponent(GeneralFourBar("reduction"), 1.0);
}

TEST(DriftOfTheGeneralFourBar, IsTheSameForOdcaAndMultipliersInTheSameCoordinates) {
  const Record odca = RunPaper("four-bar", Published("odca", Coordinates::kJoint), 1e-8, 50.0);
  const Record lagrange =
      RunPaper("four-bar", Published("lagrange", Coordinates::kJoint), 1e-8, 50.0);
  EXPECT_EQ(odca.Text("steps"), lagrange.Text("steps"));
  const double drift = odca.Number("drift_position_max");
  const double relative = std::abs(lagrange.Number("drift_position_max") / drift - 1);
  // one round-off of 1 m against a drift of 4e-7 m is 5e-10; each of some 1e3 steps adds one, and
  // those of the speeds grow with time like the drift itself
  EXPECT_LE(relative, 1e-4);
}

TEST(DriftOfTheSquareSevenBar, StaysAtRoundOffInJointCoordinates) {
  // parallelogram loops close by a linear invariant of the relative angles, which Runge-Kutta
  // methods keep: round-off is left, a walk of some 1e3 steps whose slope grows with time
  for (const std::string formulation : {"odca", "lagrange", "reduction"}) {
    for (const double tolerance : {1e-6, 1e-8, 1e-10}) {
      const Record record = RunPaper("square-seven-bar",
                                     Published(formulation, Coordinates::kJoint), tolerance, 10.0);
      EXPECT_LE(record.Number("drift_position_max"), 1e-12) << tolerance;
    }
  }
}

TEST(DriftOfTheSquareSevenBar, FollowsTheToleranceInAbsoluteCoordinates) {
  for (const std::string formulation : {"odca", "lagrange", "reduction"}) {
    const Method method = Published(formulation, Coordinates::kAbsolute);
    const auto drift = [&](double tolerance) {
      return RunPaper("square-seven-bar", method, tolerance, 10.0).Number("drift_position_max");
    };
    const double coarse = drift(1e-6), fine = drift(1e-10);
    EXPECT_GE(coarse / fine, 1e3) << ToString(method);
  }
}

}  // namespace loopbench::harness::reference::exponents_test
