#include "harness/integrator/stepper.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>
#include <stdexcept>

namespace loopbench::harness {
namespace {

// w = theta^2 (1 - theta)^2 and its derivative vanish at both ends, so p + w (a + b theta) keeps
// the end values of a cubic p. Its derivative at theta = 1/2 is zero. Derivatives are therefore
// taken at 1/3 and 2/3.
double W(double theta) { return theta * theta * (1 - theta) * (1 - theta); }
double DW(double theta) { return 2 * theta * (1 - theta) * (1 - 2 * theta); }
constexpr double kFirst = 1.0 / 3.0, kSecond = 2.0 / 3.0;

constexpr double kEpsilon = std::numeric_limits<double>::epsilon();

std::string At(double t) { return " at t = " + std::to_string(t) + " s"; }

// Ends the run with the failure of the derivative, the clock or ARKODE in the step after t_reached.
bool Fails(const GuardedOde& ode, const Stepper& stepper, int code, IntegratorResult& result) {
  if (ode.exception()) std::rethrow_exception(ode.exception());
  if (ode.failure() != Outcome::kFinished) {
    result.outcome = ode.failure();
    result.message = std::string(ToString(result.outcome)) + " in the step" + At(result.t_reached);
  } else {
    result.outcome = OutcomeOfReturnCode(code);
    result.message = result.outcome == Outcome::kFinished ? "" : stepper.message();
    if (result.outcome == Outcome::kNewtonFailure && ode.options().fixed_step > 0) {
      result.message +=
          " The step is fixed: " + std::to_string(Stepper::MaxIterations(ode.options())) +
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

// Passes the requested times to a dense observer, step by step.
class Watcher {
 public:
  Watcher(Ode& ode, const DenseObserver* dense) : ode_(ode), dense_(dense) {}

  /// Sets the start of the next step.
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
    if (Fails(ode, stepper, stepper.Step(t), result)) return;
    const std::span<const double> accepted = stepper.y();
    std::copy(accepted.begin(), accepted.end(), y.begin());
    watcher.Pass(t, y);
    result.t_reached = t;
    result.last_step = stepper.last_step();
    ++result.steps;
    const StepAction action = observe ? observe(t, y) : StepAction::kContinue;
    watcher.Reach(t, y);
    if (t >= t_end) return;
    if (action == StepAction::kStop) {
      result.message = "stopped by the observer" + At(t);
      return;
    }
    if (Exhausted(ode, result)) return;
    if (action == StepAction::kRestart) {
      stepper.Restart(t, y);
      ++result.restarts;
    }
  }
}

}  // namespace

void DenseOutput::Cubic(double theta, std::span<double> y) const {
  const double s = 1 - theta;
  for (std::size_t i = 0; i < y0_.size(); ++i) {
    const double rise = y1_[i] - y0_[i];
    y[i] =
        y0_[i] + theta * theta * (3 - 2 * theta) * rise + theta * s * (s * f0_[i] - theta * f1_[i]);
  }
}

bool DenseOutput::Prepare(double t0, std::span<const double> y0, double t1,
                          std::span<const double> y1, const Derivative& derivative) {
  t0_ = t0;
  h_ = t1 - t0;
  y0_.assign(y0.begin(), y0.end());
  y1_.assign(y1.begin(), y1.end());
  const std::size_t n = y0_.size();
  f0_.resize(n), f1_.resize(n), bump_.assign(n, 0.0), flat_.assign(n, 0.0), sloping_.assign(n, 0.0);
  std::vector<double> y(n), rate(n);
  const auto scaled = [&](double t, std::span<const double> at, std::vector<double>& f) {
    if (!derivative(t, at, f)) return false;
    for (double& value : f) value *= h_;
    return std::ranges::all_of(f, [](double value) { return std::isfinite(value); });
  };
  constexpr double kBack = -std::numeric_limits<double>::infinity();
  if (!scaled(t0, y0_, f0_) || !scaled(std::nextafter(t1, kBack), y1_, f1_)) return false;
  // derivative at a point of the curve minus the cubic's own derivative
  const auto excess = [&](double theta, std::vector<double>& more) {
    Cubic(theta, y);
    for (std::size_t i = 0; i < n; ++i) y[i] += W(theta) * bump_[i];
    if (!scaled(t0_ + theta * h_, y, rate)) return false;
    more.resize(n);
    for (std::size_t i = 0; i < n; ++i) {
      const double own = 6 * theta * (1 - theta) * (y1_[i] - y0_[i]) +
                         (1 - theta) * (1 - 3 * theta) * f0_[i] + theta * (3 * theta - 2) * f1_[i];
      more[i] = rate[i] - own;
    }
    return true;
  };
  std::vector<double> first, second;
  if (!excess(kFirst, first)) return false;
  for (std::size_t i = 0; i < n; ++i) bump_[i] = first[i] / DW(kFirst);
  if (!excess(kFirst, first) || !excess(kSecond, second)) return false;
  // (w (a + b theta))' = w' a + (w' theta + w) b at both points
  const double a1 = DW(kFirst), b1 = a1 * kFirst + W(kFirst);
  const double a2 = DW(kSecond), b2 = a2 * kSecond + W(kSecond);
  const double determinant = a1 * b2 - a2 * b1;
  for (std::size_t i = 0; i < n; ++i) {
    flat_[i] = (first[i] * b2 - second[i] * b1) / determinant;
    sloping_[i] = (a1 * second[i] - a2 * first[i]) / determinant;
  }
  return true;
}

void DenseOutput::At(double t, std::span<double> y, std::span<double> lower) const {
  const double theta = (t - t0_) / h_;
  Cubic(theta, y);
  for (std::size_t i = 0; i < y0_.size(); ++i) {
    lower[i] = y[i] + W(theta) * bump_[i];
    y[i] += W(theta) * (flat_[i] + theta * sloping_[i]);
  }
}

GuardedOde::GuardedOde(Ode& ode, const IntegratorOptions& options)
    : options_(options), ode_(ode), time_(options.time_limit_s) {
  if (FindProfile(options.profile)->is_implicit) {
    const auto size = static_cast<size_t>(ode.size());
    jacobian_.resize(size * Controlled());
    shifted_.resize(size);
    shifted_f_.resize(size);
  }
}

bool GuardedOde::Evaluate(double t, std::span<const double> y, std::span<double> ydot) noexcept {
  // Reading the clock costs a fifth of a small system's derivative, hence every 16th call only.
  constexpr std::int64_t kCallsPerClock = 16;
  if (failure_ != Outcome::kFinished || exception_) return false;
  ++calls_;
  try {
    failure_ = ode_.Derivative(std::min(t, latest_), y, ydot);
  } catch (...) {  // Integrate() throws it again
    exception_ = std::current_exception();
    return false;
  }
  if (failure_ == Outcome::kFinished &&
      !std::all_of(ydot.begin(), ydot.end(), [](double v) { return std::isfinite(v); })) {
    failure_ = Outcome::kNonFinite;
  }
  return failure_ == Outcome::kFinished && !(calls_ % kCallsPerClock == 0 && OutOfTime());
}

void GuardedOde::SetStop(double t) {
  latest_ = std::isinf(t) ? t : std::nextafter(t, -std::numeric_limits<double>::infinity());
}

bool GuardedOde::OutOfTime() {
  if (!time_.Reached()) return false;
  failure_ = Outcome::kTimeLimit;
  return true;
}

void GuardedOde::Weights(std::span<const double> y, std::span<double> weight, bool is_ode45) const {
  const size_t controlled = Controlled();
  for (size_t i = 0; i < controlled; ++i) {
    const double relative = options_.rtol * std::abs(y[i]), atol = Atol(i);
    weight[i] = 1 / (is_ode45 ? std::max(relative, atol) : relative + atol);
  }
  std::fill(weight.begin() + static_cast<std::ptrdiff_t>(controlled), weight.end(), 0.0);
}

double GuardedOde::FirstStepOfOde45(double t0, double t_end, std::span<const double> y0,
                                    double longest) {
  std::vector<double> f(y0.size());
  if (!Evaluate(t0, y0, f)) return 0;
  double rate = 0;
  for (size_t i = 0; i < Controlled(); ++i) {
    rate = std::max(rate, std::abs(f[i]) / std::max(std::abs(y0[i]), Atol(i) / options_.rtol));
  }
  rate /= 0.8 * std::pow(options_.rtol, 0.2);
  const double h = std::min(longest, t_end - t0);
  return h * rate > 1 ? 1 / rate : h;
}

// Jacobians for implicit methods: the problem's own, or difference quotients.

bool GuardedOde::EvaluateJacobian(double t, std::span<const double> y,
                                  std::span<const double> f) noexcept {
  ++jacobians_;
  std::fill(jacobian_.begin(), jacobian_.end(), 0.0);
  std::optional<JacobianWork> own;
  try {
    own = ode_.Jacobian(std::min(t, latest_), y, jacobian_);
  } catch (...) {  // Integrate() throws it again
    exception_ = std::current_exception();
    return false;
  }
  if (!own) return Differences(t, y, f);
  calls_ += own->derivatives;
  jacobian_calls_ += own->derivatives;
  dual_evaluations_ += own->dual_evaluations;
  if (!std::all_of(jacobian_.begin(), jacobian_.end(), [](double v) { return std::isfinite(v); })) {
    failure_ = Outcome::kNonFinite;
  }
  return failure_ == Outcome::kFinished;
}

// One column per component. The increment is the root of round-off times the component's size, at
// least atol / rtol, below which the tolerances call a component small: half the digits of the
// quotient are good, which is plenty for Newton's iteration. It follows the direction of motion,
// so as not to leave the region where f is defined (L. Shampine, M. Reichelt, The MATLAB ODE suite,
// 1997, numjac).
bool GuardedOde::Differences(double t, std::span<const double> y, std::span<const double> f) {
  const double root = std::sqrt(std::numeric_limits<double>::epsilon());
  std::copy(y.begin(), y.end(), shifted_.begin());
  for (size_t j = 0; j < Controlled(); ++j) {
    const double increment = root * std::max(std::abs(y[j]), Atol(j) / options_.rtol);
    shifted_[j] = y[j] + std::copysign(increment, f[j]);
    const std::int64_t before = calls_;
    const bool is_good = Evaluate(t, shifted_, shifted_f_);
    jacobian_calls_ += calls_ - before;
    if (!is_good) return false;
    const double shift = shifted_[j] - y[j];  // as it was rounded
    double* column = jacobian_.data() + j * y.size();
    for (size_t i = 0; i < y.size(); ++i) column[i] = (shifted_f_[i] - f[i]) / shift;
    shifted_[j] = y[j];
  }
  return true;
}

IntegratorResult Integrate(Ode& ode, double t0, double t_end, std::vector<double>& y,
                           const IntegratorOptions& options, const StepObserver& observe,
                           const DenseObserver* dense) {
  std::string fault = Validate(options);
  if (fault.empty() && y.empty()) fault = "the state is empty";
  if (fault.empty() && std::ssize(y) != ode.size()) {
    fault = "the state has " + std::to_string(y.size()) + " components, the problem " +
            std::to_string(ode.size());
  }
  if (fault.empty() && !(ode.num_quadratures() >= 0 && ode.num_quadratures() < ode.size())) {
    fault = std::to_string(ode.num_quadratures()) + " of " + std::to_string(ode.size()) +
            " components are quadratures; at least one must not be";
  }
  const std::ptrdiff_t controlled = ode.size() - ode.num_quadratures();
  if (fault.empty() && !options.atols.empty() && std::ssize(options.atols) != controlled) {
    fault = std::to_string(options.atols.size()) + " absolute tolerances for " +
            std::to_string(controlled) + " components";
  }
  if (fault.empty() && !(t_end >= t0)) {
    fault = "t_end is " + std::to_string(t_end) + "; it must not lie before t0";
  }
  if (!fault.empty()) throw std::invalid_argument(fault);
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
