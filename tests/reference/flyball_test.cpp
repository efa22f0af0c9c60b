// The stiff flyball governor of benchmark A05: loops closed by spring-dampers whose modes decay in
// 1e-4 s, against numbers of two stiff integrators on a reduction to three coordinates.
#include "tests/reference/cases.h"
#include "tests/reference/published_numbers.h"
#include "tests/reference/simulate.h"

namespace loopbench::harness::reference::flyball_test {

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

class Flyball : public testing::TestWithParam<Method> {};

TEST_P(Flyball, ExplicitMethodFollowsTheDerivedNumbers) {
  // 3.6e3 steps a second in joint coordinates, for stability; 1.3e4 in absolute ones
  const bool joint = GetParam().coordinates == Coordinates::kJoint;
  const A05State& exact = joint ? kA05Derived.back() : kA05Derived.front();
  const Simulation run = Simulate(Governor(), GetParam(), Options("ode45", 1e-9), exact.t);
  ASSERT_EQ(run.result.outcome, Outcome::kFinished) << run.result.message;
  // steps for stability are far shorter than accuracy asks for: one tolerance per swing of 1 s
  EXPECT_LE(Difference(StateOf(run.last), exact), 1e-9 * 10);
}

TEST_P(Flyball, ImplicitMethodNeedsAFiftiethOfTheSteps) {
  if (GetParam().coordinates != Coordinates::kJoint) return;
  const A05State& exact = kA05Derived.back();
  const Simulation stiff = Simulate(Governor(), GetParam(), Options("kvaerno-54", 1e-6), exact.t);
  const Simulation other = Simulate(Governor(), GetParam(), Options("ode45", 1e-6), exact.t);
  ASSERT_EQ(stiff.result.outcome, Outcome::kFinished) << stiff.result.message;
  ASSERT_EQ(other.result.outcome, Outcome::kFinished) << other.result.message;
  EXPECT_LE(50 * stiff.result.steps, other.result.steps);
  // each step adds an error below the tolerance
  EXPECT_LE(Difference(StateOf(stiff.last), exact), 1e-6 * static_cast<double>(stiff.result.steps));
}

INSTANTIATE_TEST_SUITE_P(Methods, Flyball, testing::ValuesIn(RankRevealingMethods()),
                         NameOfParam());

}  // namespace loopbench::harness::reference::flyball_test
