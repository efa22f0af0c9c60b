#include "tests/reference/simulate.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "harness/run/run.h"
#include "mechanism/start/assembly.h"
#include "tests/reference/cases.h"

namespace loopbench::harness::reference {
namespace {

/// The formulation's system with two quadratures: the work of forces without a potential, and the
/// integral of the kinetic energy.
template <class Space>
class WithIntegrals final : public Ode {
 public:
  explicit WithIntegrals(System<Space, double>& formulation) : formulation_(formulation) {}
  int size() const override { return formulation_.state_size() + 2; }
  int num_quadratures() const override { return formulation_.state_size() > 0 ? 2 : 0; }
  Outcome Derivative(double t, std::span<const double> y, std::span<double> ydot) override {
    const std::size_t n = y.size() - 2;
    const Outcome outcome = formulation_.Examine(t, y.first(n), ydot.first(n));
    const Power<double> power = formulation_.TotalPower();
    ydot[n] = power.supplied - power.dissipated;
    ydot[n + 1] = ComputeEnergy(formulation_.kinematics()).kinetic;
    return outcome;
  }

 private:
  System<Space, double>& formulation_;
};

template <class Space>
BodyState StateOf(const Pose<Space, double>& X, const Velocity<Space, double>& V) {
  BodyState state;
  state.R.topLeftCorner<Space::kLin, Space::kLin>() = X.R.eigen();
  state.p.head<Space::kLin>() = X.p.eigen();
  state.w.tail<Space::kRot>() = V.angular.eigen();
  state.v.head<Space::kLin>() = V.linear.eigen();
  return state;
}

template <class Space>
Snapshot SnapshotOf(double t, const Kinematics<Space, double>& kinematics) {
  Snapshot snapshot;
  snapshot.t = t;
  for (std::size_t i = 0; i < kinematics.poses().size(); ++i) {
    snapshot.bodies.push_back(StateOf(kinematics.poses()[i], kinematics.motions()[i]));
  }
  const Energy<double> energy = ComputeEnergy(kinematics);
  snapshot.kinetic = energy.kinetic;
  snapshot.potential = energy.potential;
  return snapshot;
}

template <class Space>
Simulation SimulateIn(const MechanismDescription& description, const Method& method,
                      const IntegratorOptions& options, double horizon, const Watch& watch) {
  const Mechanism<Space, double> mechanism(description, method.coordinates);
  Simulation simulation;
  const Start<double> start = Assemble<Space>(description, mechanism);
  const auto formulation = MakeFormulation<Space>(method, mechanism);
  simulation.result.outcome = start.outcome;
  simulation.result.message = start.message;
  if (start.outcome == Outcome::kFinished) {
    simulation.result.outcome = formulation->Start(0.0, start.q, start.u);
  }
  if (simulation.result.outcome != Outcome::kFinished) return simulation;

  const std::size_t n = formulation->state_size();
  std::vector<double> y(n + 2, 0.0), ydot(n);
  formulation->ToState(start.q, start.u, std::span(y).first(n));
  double first_energy = std::nan("");
  Outcome failure = Outcome::kFinished;  // of an accepted state
  const StepObserver observe = [&](double t, std::span<double> state) {
    // which adds the work of impulses
    const bool restart = formulation->BeginStep(t, state.first(n + 1));
    failure = formulation->FromState(t, state.first(n));
    if (failure != Outcome::kFinished) return StepAction::kStop;
    simulation.last = SnapshotOf(t, formulation->kinematics());
    const double energy = simulation.last.kinetic + simulation.last.potential - state[n];
    if (std::isnan(first_energy)) first_energy = energy;
    simulation.energy_error = std::max(simulation.energy_error, std::abs(energy - first_energy));
    if (watch) watch(simulation.last);
    return restart ? StepAction::kRestart : StepAction::kContinue;
  };
  WithIntegrals<Space> ode(*formulation);
  IntegratorOptions stops = options;
  stops.stop_times = mechanism.stop_times();
  simulation.result = Integrate(ode, 0.0, horizon, y, stops, observe);
  if (failure != Outcome::kFinished) simulation.result.outcome = failure;
  simulation.kinetic_integral = y[n + 1];
  return simulation;
}

}  // namespace

Simulation Simulate(const MechanismDescription& description, const Method& method,
                    const IntegratorOptions& options, double horizon, const Watch& watch) {
  return ForSpace(description.space, [&]<class Space>(Space) {
    return SimulateIn<Space>(description, method, options, horizon, watch);
  });
}

IntegratorOptions Options(const std::string& profile, double tolerance) {
  IntegratorOptions options;
  options.profile = profile;
  options.rtol = options.atol = tolerance;
  options.time_limit_s = 600.0;
  return options;
}

int BodyNamed(const MechanismDescription& description, const std::string& name) {
  const auto it = std::ranges::find(description.bodies, name, &BodyDescription::name);
  if (it == description.bodies.end()) throw std::invalid_argument("no body " + name);
  return static_cast<int>(it - description.bodies.begin());
}

Eigen::Vector3d PointOf(const MechanismDescription& description, const Snapshot& snapshot, int body,
                        const Eigen::Vector3d& at) {
  const BodyState& state = snapshot.bodies[body];
  return state.p + state.R * (at - description.bodies[body].com);
}

Eigen::Vector3d VelocityOf(const MechanismDescription& description, const Snapshot& snapshot,
                           int body, const Eigen::Vector3d& at) {
  const BodyState& state = snapshot.bodies[body];
  return state.v + state.w.cross(state.R * (at - description.bodies[body].com));
}

Eigen::Vector3d AnyTurn() { return 1.2345 * Eigen::Vector3d(0.48, -0.6, 0.64); }

Eigen::Matrix3d AnyRotation() {
  return Eigen::AngleAxisd(AnyTurn().norm(), AnyTurn().normalized()).toRotationMatrix();
}

const std::vector<Method>& RankRevealingMethods() {
  static const std::vector<Method> kMethods = [] {
    std::vector<Method> methods = PublishedMethods();
    for (Method& method : methods) method.solver = SolverKind::kRankRevealing;
    return methods;
  }();
  return kMethods;
}

const std::vector<Method>& PositionMethods() {
  static const std::vector<Method> kMethods = MethodsAt({Enforcement::kPosition});
  return kMethods;
}

}  // namespace loopbench::harness::reference
