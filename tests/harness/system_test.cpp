// A system as the integrator sees it: Jacobians at the right state, orders of implicit
// profiles.
#include <gtest/gtest.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <iostream>
#include <memory>
#include <vector>

#include "harness/integrator/arkode.h"
#include "harness/run/run.h"
#include "mechanism/start/assembly.h"
#include "tests/reference/cases.h"

namespace loopbench::harness {
namespace system_test {

using namespace reference;

/// A shipped planar mechanism with a formulation at its start.
struct Scene {
  explicit Scene(const std::string& name, const Method& method)
      : description(ReadMechanism(kConfigs / "mechanisms" / (name + ".json")).description),
        mechanism(description, method.coordinates),
        system(MakeFormulation<Planar>(method, mechanism)) {
    const Start<double> start = Assemble<Planar>(description, mechanism);
    EXPECT_EQ(system->Start(0.0, start.q, start.u), Outcome::kFinished);
    y.resize(static_cast<std::size_t>(system->state_size()));
    system->ToState(start.q, start.u, y);
  }
  void UseJacobian() {
    system->UseJacobian(std::make_unique<ForwardJacobian<Planar>>(description, *system));
  }

  MechanismDescription description;
  Mechanism<Planar, double> mechanism;
  std::unique_ptr<System<Planar, double>> system;
  std::vector<double> y;
};

const Method kColumn{"odca", Enforcement::kAcceleration, Coordinates::kJoint,
                     SolverKind::kRankRevealing};

TEST(SystemTest, EvaluatesAfreshForAJacobianWhereItHasMovedAway) {
  Scene scene("four-bar", kColumn);
  System<Planar, double>& system = *scene.system;
  scene.UseJacobian();
  const std::size_t n = scene.y.size();
  std::vector<double> ydot(n), elsewhere = scene.y, at_once(n * n), later(n * n), moved(n * n);
  elsewhere[0] += 0.1;
  system.Derivative(0.0, scene.y, ydot);
  EXPECT_EQ(system.Jacobian(0.0, scene.y, at_once).value().derivatives, 0);
  EXPECT_EQ(system.Jacobian(0.0, scene.y, later).value().derivatives, 1);
  EXPECT_EQ(later, at_once);
  EXPECT_EQ(system.Jacobian(0.0, elsewhere, moved).value().derivatives, 1);
  EXPECT_NE(moved, at_once);
  later = moved;
  // an observer evaluates it elsewhere
  system.Derivative(0.0, scene.y, ydot);
  system.Derivative(0.0, elsewhere, ydot);
  EXPECT_EQ(system.Jacobian(0.0, scene.y, later).value().derivatives, 1);
  EXPECT_EQ(later, at_once);
}

TEST(SystemTest, HasNoJacobianUnlessGivenOne) {
  Scene scene("four-bar", kColumn);
  std::vector<double> jacobian(scene.y.size() * scene.y.size());
  EXPECT_FALSE(scene.system->Jacobian(0.0, scene.y, jacobian).has_value());
}

struct Order {
  const char* profile;
  double order, step;
};

/// Largest error of the state after a second, in fixed steps. Newton's iteration leaves a hundredth
/// of 1e-14 in each stage.
double ErrorWithStep(const std::string& profile, double step, const std::vector<double>& exact) {
  Scene scene("four-bar", kColumn);
  scene.UseJacobian();
  IntegratorOptions options;
  options.profile = profile;
  options.rtol = options.atol = 1e-14;
  options.fixed_step = step;
  const IntegratorResult result = Integrate(*scene.system, 0.0, 1.0, scene.y, options);
  EXPECT_EQ(result.outcome, Outcome::kFinished) << result.message;
  EXPECT_EQ(result.jacobian_rhs_evaluations, 0);
  EXPECT_EQ(result.dual_evaluations, result.jacobians);  // six components, eight columns at once
  double error = 0.0;
  for (std::size_t i = 0; i < exact.size(); ++i) {
    error = std::max(error, std::abs(scene.y[i] - exact[i]));
  }
  return error;
}

TEST(SystemTest, ImplicitProfilesHaveTheirOrderWithForwardJacobians) {
  Scene exact("four-bar", kColumn);
  IntegratorOptions options;
  options.profile = "fehlberg-78";
  options.rtol = options.atol = 1e-14;
  ASSERT_EQ(Integrate(*exact.system, 0.0, 1.0, exact.y, options).outcome, Outcome::kFinished);
  for (const Order& one : {Order{"trbdf2", 2, 1.0 / 64},
                           {"kennedy-carpenter-32", 3, 1.0 / 64},
                           {"kennedy-carpenter-43", 4, 1.0 / 32},
                           {"kvaerno-54", 5, 1.0 / 32},
                           {"kennedy-carpenter-54", 5, 1.0 / 16}}) {
    const double coarse = ErrorWithStep(one.profile, one.step, exact.y);
    const double fine = ErrorWithStep(one.profile, one.step / 2, exact.y);
    const double order = std::log2(coarse / fine);
    std::cout << one.profile << ": error " << fine << ", order " << order << "\n";
    EXPECT_GT(fine, 1e-12) << one.profile;  // above round-off, so that there is an order to see
    EXPECT_NEAR(order, one.order, 0.3) << one.profile;  // half-way to the next is 0.5
  }
}

}  // namespace system_test
}  // namespace loopbench::harness
