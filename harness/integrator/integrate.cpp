#include <algorithm>
#include <cmath>
#include <exception>
#include <limits>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include "harness/integrator/arkode.h"
#include "harness/integrator/guarded_ode.h"
#include "harness/integrator/stepper.h"

namespace loopbench::harness {
namespace {

constexpr double kEpsilon = std::numeric_limits<double>::epsilon();

std::string At(double t) { return " at t = " + std::to_string(t) + " s"; }

// Ends the run with what the derivative, the clock or ARKODE reported in the step after t_reached.
bool Fails(const GuardedOde& ode, const Stepper& stepper, int code, IntegratorResult& result) {
  if (ode.exception()) {
    std::rethrow_exception(ode.exception());
  }
  if (ode.failure() != Outcome::kFinished) {
    result.outcome = ode.failure();
    result.message = std::string(ToString(result.outcome)) + " in the step" + At(result.t_reached);
  } else {
    result.outcome = OutcomeOfReturnCode(code);
    result.message = result.outcome == Outcome::kFinished ? "" : stepper.message();
    if (result.outcome == Outcome::kNewtonFailure && ode.options().fixed_step > 0) {
      result.message += " The step is fixed: " + std::to_string(Stepper::kMostIterations) +
                        " iterations are its limit, and a shorter step needs fewer.";
    }
  }
  return result.outcome != Outcome::kFinished;
}

// True if the run must end after an accepted step that is not its last.
bool Exhausted(GuardedOde& ode, IntegratorResult& result) {
  if (ode.OutOfTime()) {
    result.outcome = Outcome::kTimeLimit;
  } else if (result.steps >= ode.options().step_limit) {
    result.outcome = Outcome::kStepLimit;
  } else if (result.last_step <= 16 * kEpsilon * std::abs(result.t_reached)) {
    result.outcome = Outcome::kStepTooSmall;  // MATLAB's shortest step
  } else {
    return false;
  }
  result.message = std::string(ToString(result.outcome)) + At(result.t_reached);
  return true;
}

// Shows a dense observer the times it asks for, from step to step.
class Watcher {
 public:
  Watcher(Ode& ode, const DenseObserver* dense) : ode_(ode), dense_(dense) {}

  /// Where the next step begins.
  void Leave(double t, const std::vector<double>& y) {
    if (dense_ == nullptr) return;
    t0_ = t;
    y0_ = y;
  }

  /// Before the step's end is observed: the times within the step.
  void Pass(double t1, const std::vector<double>& y1) {
    if (dense_ == nullptr || !IsBefore(t1)) return;
    const DenseDerivative own = [&](double t, std::span<const double> y, std::span<double> f) {
      return ode_.Derivative(t, y, f) == Outcome::kFinished;
    };
    const bool good =
        output_.Prepare(t0_, y0_, t1, y1, dense_->derivative ? dense_->derivative : own);
    y_.resize(y1.size()), lower_.resize(y1.size());
    for (; IsBefore(t1); ++next_) {
      if (!good) continue;
      output_.At(dense_->times[next_], y_, lower_);
      dense_->observe(next_, y_, lower_);
    }
  }

  /// After the end of a step, or the start, was observed.
  void Reach(double t, const std::vector<double>& y) {
    if (dense_ == nullptr) return;
    for (; next_ < dense_->times.size() && dense_->times[next_] <= t + Close(t); ++next_) {
      dense_->observe(next_, y, y);
    }
  }

 private:
  static double Close(double t) { return 100 * kEpsilon * std::abs(t); }
  bool IsBefore(double t) const {
    return next_ < dense_->times.size() && dense_->times[next_] < t - Close(t);
  }

  Ode& ode_;
  const DenseObserver* dense_;
  std::size_t next_ = 0;
  DenseOutput output_;
  double t0_ = 0.0;
  std::vector<double> y0_, y_, lower_;
};

// The loop over accepted steps, from a start point that has been observed.
void Advance(GuardedOde& ode, Stepper& stepper, double t_end, std::vector<double>& y,
             const StepObserver& observe, Watcher& watcher, IntegratorResult& result) {
  for (double t = result.t_reached;;) {
    watcher.Leave(t, y);
    if (Fails(ode, stepper, stepper.Step(t), result)) {
      return;
    }
    const std::span<const double> accepted = stepper.y();
    std::copy(accepted.begin(), accepted.end(), y.begin());
    watcher.Pass(t, y);
    result.t_reached = t;
    result.last_step = stepper.last_step();
    ++result.steps;
    const StepAction action = observe ? observe(t, y) : StepAction::kContinue;
    watcher.Reach(t, y);
    if (t >= t_end) {
      return;
    }
    if (action == StepAction::kStop) {
      result.message = "stopped by the observer" + At(t);
      return;
    }
    if (Exhausted(ode, result)) {
      return;
    }
    if (action == StepAction::kRestart) {
      stepper.Restart(t, y);
      ++result.restarts;
    }
  }
}

}  // namespace

IntegratorResult Integrate(Ode& ode, double t0, double t_end, std::vector<double>& y,
                           const IntegratorOptions& options, const StepObserver& observe,
                           const DenseObserver* dense) {
  std::string fault = Validate(options);
  if (fault.empty() && y.empty()) {
    fault = "the state is empty";
  }
  if (fault.empty() && std::ssize(y) != ode.size()) {
    fault = "the state has " + std::to_string(y.size()) + " components, the problem " +
            std::to_string(ode.size());
  }
  if (fault.empty() && !(ode.num_quadratures() >= 0 && ode.num_quadratures() < ode.size())) {
    fault = std::to_string(ode.num_quadratures()) + " of " + std::to_string(ode.size()) +
            " components are quadratures; at least one must not be";
  }
  if (fault.empty() && !(t_end >= t0)) {
    fault = "t_end is " + std::to_string(t_end) + "; it must not lie before t0";
  }
  if (!fault.empty()) {
    throw std::invalid_argument(fault);
  }
  GuardedOde guarded(ode, options);
  IntegratorResult result;
  result.t_reached = t0;
  const StepAction action = observe ? observe(t0, y) : StepAction::kContinue;
  Watcher watcher(ode, dense);
  watcher.Reach(t0, y);
  if (action == StepAction::kStop) {
    result.message = "stopped by the observer" + At(t0);
  } else if (t0 < t_end) {
    Stepper stepper(guarded, t0, t_end, y);
    Advance(guarded, stepper, t_end, y, observe, watcher, result);
    result.rejected = stepper.rejected();
    result.newton_iterations = stepper.newton_iterations();
    result.newton_failures = stepper.newton_failures();
  }
  result.rhs_evaluations = guarded.calls();
  result.jacobians = guarded.jacobians();
  result.jacobian_rhs_evaluations = guarded.jacobian_calls();
  result.dual_evaluations = guarded.dual_evaluations();
  result.wall_s = guarded.wall_s();
  result.cpu_s = guarded.cpu_s();
  return result;
}

}  // namespace loopbench::harness
