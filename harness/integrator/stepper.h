// Guarded steps: exceptions of a right-hand side, limits, and the loop over steps.
#pragma once

#include <cstdint>
#include <exception>
#include <limits>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "harness/base/text.h"
#include "harness/config/options.h"
#include "harness/integrator/arkode.h"
#include "mechanism/description/outcome.h"

namespace loopbench::harness {

/// An Ode behind the checks that ARKODE lacks: a derivative that is not finite (ARKODE would
/// shorten the step for ever), the CPU clock, and exceptions, which must not travel through C
/// frames. The first failure is kept for the result and ends every later evaluation. Also computes
/// the quantities of a profile that need only options, state and derivative.
class GuardedOde {
 public:
  /// Starts the clocks. Both arguments must outlive the object.
  GuardedOde(Ode& ode, const IntegratorOptions& options);

  /// Returns false if the run must end; `failure()` or `exception()` then give the reason.
  bool Evaluate(double t, std::span<const double> y, std::span<double> ydot) noexcept;

  /// Renews jacobian() from the problem's own, or else by forward differences, whose evaluations
  /// count as jacobian_calls(); f is the derivative at (t, y). False as above.
  bool EvaluateJacobian(double t, std::span<const double> y, std::span<const double> f) noexcept;

  /// df_i/dy_j at [i + y.size() * j] for all i and for the j that are not quadratures.
  std::span<const double> jacobian() const { return jacobian_; }

  /// Limits the times passed to the derivative to less than `t`; infinity removes the limit.
  void SetStop(double t);

  /// True, and the failure is kTimeLimit, once the CPU time is used up.
  bool OutOfTime();

  /// The reciprocal of each component's tolerance: 1 / max(rtol |y_i|, atol) for ode45, else
  /// 1 / (rtol |y_i| + atol). Zero for quadratures.
  void Weights(std::span<const double> y, std::span<double> weight, bool is_ode45) const;

  /// MATLAB's first step: the time in which the fastest component changes by 0.8 rtol^(1/5) of its
  /// magnitude (at least atol / rtol), at most `longest` and the interval. Evaluates the
  /// derivative; 0 if that fails.
  double FirstStepOfOde45(double t0, double t_end, std::span<const double> y0, double longest);

  /// Number of components that are not quadratures.
  size_t Controlled() const { return static_cast<size_t>(ode_.size() - ode_.num_quadratures()); }

  /// Wall time and the thread's CPU time since construction, s.
  double wall_s() const { return time_.wall_s(); }
  double cpu_s() const { return time_.cpu_s(); }

  Outcome failure() const { return failure_; }
  std::exception_ptr exception() const { return exception_; }

  /// Evaluations of the derivative, the failing one included, without those for Jacobians.
  std::int64_t calls() const { return calls_ - jacobian_calls_; }
  std::int64_t jacobian_calls() const { return jacobian_calls_; }  ///< evaluations for Jacobians
  std::int64_t jacobians() const { return jacobians_; }            ///< Jacobians evaluated
  /// Evaluations with dual numbers, of a problem with Jacobians of its own.
  std::int64_t dual_evaluations() const { return dual_evaluations_; }
  const IntegratorOptions& options() const { return options_; }

 private:
  /// Absolute tolerance of a component.
  double Atol(size_t i) const { return options_.atols.empty() ? options_.atol : options_.atols[i]; }
  bool Differences(double t, std::span<const double> y, std::span<const double> f);

  const IntegratorOptions& options_;
  Ode& ode_;
  double latest_ = std::numeric_limits<double>::infinity();  // latest time passed to the derivative
  CpuLimit time_;
  std::int64_t calls_ = 0, jacobian_calls_ = 0, jacobians_ = 0, dual_evaluations_ = 0;
  std::vector<double> jacobian_, shifted_, shifted_f_;  // empty for explicit profiles
  Outcome failure_ = Outcome::kFinished;
  std::exception_ptr exception_;
};

/// ARKODE set up for one profile and one interval, advanced one accepted step at a time. The
/// private part keeps SUNDIALS types out of this header; Integrate() (arkode.h) is the loop over
/// Step().
class Stepper {
 public:
  /// Returns the limit of Newton's iterations in a stage. A step that may shrink is cheaper
  /// shortened than iterated on; a fixed one cannot.
  static int MaxIterations(const IntegratorOptions& options) {
    if (options.max_newton_iterations > 0) return options.max_newton_iterations;
    return options.fixed_step > 0 ? 50 : 8;
  }

  /// Takes the profile, step limits and stop times from `ode.options()`, which must be valid. May
  /// evaluate the derivative at (t0, y0) to choose the first step; requires t0 < t_end.
  Stepper(GuardedOde& ode, double t0, double t_end, const std::vector<double>& y0);
  ~Stepper();

  /// Takes one accepted step and returns ARKODE's code (see OutcomeOfReturnCode). On success t and
  /// y() are the step's end; a step that reaches t_end or a stop time ends there exactly.
  int Step(double& t);

  /// Restarts from (t, y), t < t_end, with the size planned for the next step.
  void Restart(double t, const std::vector<double>& y);

  std::span<const double> y() const;
  const std::string& message() const;  ///< ARKODE's last error text
  double last_step() const;            ///< length of the last accepted step, s
  std::int64_t rejected() const;       ///< failed error tests so far

  // Zero for explicit profiles:
  std::int64_t newton_iterations() const;  ///< so far
  std::int64_t newton_failures() const;    ///< stages so far that did not converge

 private:
  struct Arkode;
  std::unique_ptr<Arkode> arkode_;
};

}  // namespace loopbench::harness
