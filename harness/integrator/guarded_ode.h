// The derivative as the integrator's C library may call it.
#pragma once

#include <chrono>
#include <cstdint>
#include <exception>
#include <limits>
#include <span>

#include "harness/integrator/ode.h"
#include "harness/integrator/options.h"
#include "mechanism/outcome.h"

namespace loopbench::harness {

/// An Ode behind the checks that ARKODE lacks: a derivative that is not finite (ARKODE would
/// shorten the step for ever), the wall clock, and exceptions, which must not travel through C
/// frames. The first failure is kept for the result and ends every later evaluation. Also computes
/// the quantities of a profile that need only options, state and derivative.
class GuardedOde {
 public:
  /// Starts the clock. Both arguments must outlive the object.
  GuardedOde(Ode& ode, const IntegratorOptions& options);

  /// False if the run must end; `failure()` or `exception()` then says why.
  bool Evaluate(double t, std::span<const double> y, std::span<double> ydot) noexcept;

  /// Lets the derivative see only times before `t` from now on; infinity lifts this.
  void SetStop(double t);

  /// True, and the failure is kTimeLimit, once the wall time is used up.
  bool OutOfTime();

  /// The reciprocal of each component's tolerance: 1 / max(rtol |y_i|, atol) for ode45, else
  /// 1 / (rtol |y_i| + atol). Zero for quadratures.
  void Weights(std::span<const double> y, std::span<double> weight, bool is_ode45) const;

  /// MATLAB's first step: the time in which the fastest component changes by 0.8 rtol^(1/5) of its
  /// magnitude (at least atol / rtol), at most `longest` and the interval. Evaluates the
  /// derivative; if that fails it returns 0, which leaves the choice to ARKODE, which never gets to
  /// use it.
  double FirstStepOfOde45(double t0, double t_end, std::span<const double> y0, double longest);

  /// Wall time since construction, s.
  double wall_s() const;

  Outcome failure() const { return failure_; }
  std::exception_ptr exception() const { return exception_; }
  std::int64_t calls() const { return calls_; }  ///< of the derivative, the failing one included
  const IntegratorOptions& options() const { return options_; }

 private:
  using Clock = std::chrono::steady_clock;
  /// Number of components that are not quadratures.
  size_t Controlled() const { return static_cast<size_t>(ode_.size() - ode_.num_quadratures()); }

  const IntegratorOptions& options_;
  Ode& ode_;
  double latest_ = std::numeric_limits<double>::infinity();  // time that the derivative may see
  Clock::time_point start_;
  std::int64_t calls_ = 0;
  Outcome failure_ = Outcome::kFinished;
  std::exception_ptr exception_;
};

}  // namespace loopbench::harness
