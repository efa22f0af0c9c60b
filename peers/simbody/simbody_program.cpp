#include "peers/simbody/simbody_program.h"

#include "peers/simbody/simbody_model.h"

namespace loopbench::peers {
namespace {

class SimbodyProgram final : public Program {
 public:
  explicit SimbodyProgram(const exchange::Model& model) : model_(model) {
    state_ = model_.system.realizeTopology();
    model_.system.realizeModel(state_);
  }

  void Derivative(const double* q, const double* u, double* qdot, double* udot) override {
    Set(q, u, state_);
    model_.system.realize(state_, SimTK::Stage::Acceleration);
    for (const Mobilizer& one : model_.mobilizers) {
      for (int i = 0; i < one.num_q; ++i) {
        qdot[one.q + i] = one.sign * one.body.getOneQDot(state_, i);
      }
      for (int i = 0; i < one.num_u; ++i) {
        udot[one.u + i] = one.sign * one.body.getOneUDot(state_, i);
      }
    }
  }

  void Start(const double* q, const double* u, double tolerance, double t_end) override {
    Set(q, u, state_);
    state_.setTime(0.0);
    integrator_ = std::make_unique<SimTK::RungeKuttaMersonIntegrator>(model_.system);
    integrator_->setAccuracy(tolerance);
    integrator_->setReturnEveryInternalStep(true);
    integrator_->setAllowInterpolation(false);
    integrator_->setFinalTime(t_end);
    integrator_->initialize(state_);
    integrator_->resetAllStatistics();
    t_end_ = t_end;
  }

  void Step() override {
    const double before = time();
    // the first returns only signal the start of the run
    try {
      while (!(time() > before)) {
        const auto status = integrator_->stepTo(t_end_);
        if (status == SimTK::Integrator::EndOfSimulation) return;
      }
    } catch (const std::exception& error) {
      // one exception type for all step failures: its text distinguishes them
      const std::string text = error.what();
      const std::size_t place = text.find("Unable to advance time past");
      if (place == std::string::npos) throw;
      throw StepTooSmall(text.substr(place, text.find('\n', place) - place));
    }
  }

  double time() const override { return integrator_->getAdvancedTime(); }

  void State(double* q, double* u) const override {
    const SimTK::State& state = integrator_->getAdvancedState();
    for (const Mobilizer& one : model_.mobilizers) {
      for (int i = 0; i < one.num_q; ++i) q[one.q + i] = one.sign * one.body.getOneQ(state, i);
      for (int i = 0; i < one.num_u; ++i) u[one.u + i] = one.sign * one.body.getOneU(state, i);
    }
  }

  Counts counts() const override {
    if (!integrator_) return {};
    return {integrator_->getNumStepsTaken(),
            integrator_->getNumStepsAttempted() - integrator_->getNumStepsTaken(),
            integrator_->getNumRealizations(), integrator_->getNumProjections()};
  }

 private:
  void Set(const double* q, const double* u, SimTK::State& state) const {
    for (const Mobilizer& one : model_.mobilizers) {
      for (int i = 0; i < one.num_q; ++i) one.body.setOneQ(state, i, one.sign * q[one.q + i]);
      for (int i = 0; i < one.num_u; ++i) one.body.setOneU(state, i, one.sign * u[one.u + i]);
    }
  }

  SimbodyModel model_;
  SimTK::State state_;
  std::unique_ptr<SimTK::RungeKuttaMersonIntegrator> integrator_;
  double t_end_ = 0.0;
};

}  // namespace

std::unique_ptr<Program> MakeSimbodyProgram(const exchange::Model& model) {
  return std::make_unique<SimbodyProgram>(model);
}

}  // namespace loopbench::peers
