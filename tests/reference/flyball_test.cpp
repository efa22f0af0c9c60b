// The stiff flyball governor of benchmark A05: loops closed by spring-dampers whose modes decay in
// 1e-4 s, against numbers of two stiff integrators on a reduction to three coordinates.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <iostream>

#include "tests/reference/cases.h"
#include "tests/reference/published_numbers.h"
#include "tests/reference/simulate.h"

namespace loopbench::harness::reference {
namespace {

const MechanismDescription& Governor() {
  static const MechanismDescription kGovernor =
      ReadMechanism(kConfigs / "mechanisms/flyball-governor.json").description;
  return kGovernor;
}

/// Slider, rod and shaft of a snapshot as A05State.
A05State StateOf(const Snapshot& snapshot) {
  const auto& bodies = snapshot.bodies;
  const Eigen::Vector3d rod = bodies[BodyNamed(Governor(), "rod1")].R.col(0);
  return {snapshot.t, bodies[BodyNamed(Governor(), "slider")].p.z(),
          std::atan2(-rod.z(), rod.head<2>().norm()), bodies[BodyNamed(Governor(), "shaft")].w.z()};
}

/// Largest of the three differences [m, rad, rad/s].
double Difference(const A05State& a, const A05State& b) {
  return std::max({std::abs(a.s - b.s), std::abs(a.alpha - b.alpha), std::abs(a.omega - b.omega)});
}

class Flyball : public testing::TestWithParam<Column> {};

TEST_P(Flyball, ExplicitMethodFollowsTheDerivedNumbers) {
  // joint coordinates: 5e3 steps a second, for stability; absolute ones three times as many
  const bool joint = GetParam().coordinates == Coordinates::kJoint;
  constexpr double kRtol = 1e-9;
  for (const A05State& exact : kA05Derived) {
    if (exact.t > (joint ? 10.0 : 0.5)) continue;
    if (joint && exact.t < 5.0) continue;
    double lowest = 1.0, highest = 0.0;
    const Simulation run = Simulate(Governor(), GetParam(), Options("ode45", kRtol), exact.t,
                                    [&](const Snapshot& snapshot) {
                                      lowest = std::min(lowest, StateOf(snapshot).s);
                                      highest = std::max(highest, StateOf(snapshot).s);
                                    });
    ASSERT_EQ(run.result.outcome, Outcome::kFinished) << run.result.message;
    const double error = Difference(StateOf(run.last), exact);
    EXPECT_LE(error, 1e-8) << exact.t;
    if (exact.t == 10.0) {
      EXPECT_NEAR(lowest, kA05Lowest, 1e-6);
      EXPECT_NEAR(highest, kA05Highest, 1e-6);
    }
    std::cout << exact.t << " s: error " << error << ", " << run.result.steps << " steps, "
              << run.result.rhs_evaluations << " right-hand sides, energy balance "
              << run.energy_error << " J\n";
  }
}

INSTANTIATE_TEST_SUITE_P(Columns, Flyball, testing::ValuesIn(RankRevealingColumns()),
                         [](const auto& column) { return NameOf(column.param); });

}  // namespace
}  // namespace loopbench::harness::reference
