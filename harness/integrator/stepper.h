// One run's integrator, advanced one accepted step at a time.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "harness/integrator/guarded_ode.h"

namespace loopbench::harness {

/// ARKODE set up for one profile and one interval. The private part keeps SUNDIALS types out of
/// this header; Integrate() (arkode.h) is the loop over Step() with limits and observers.
class Stepper {
 public:
  static constexpr int kMostIterations = 50;  ///< of Newton in a stage of a step of fixed length

  /// The profile, the limits on steps and the stop times are those of `ode.options()`, which must
  /// be valid. May evaluate the derivative at (t0, y0) to choose the first step; requires t0 <
  /// t_end.
  Stepper(GuardedOde& ode, double t0, double t_end, const std::vector<double>& y0);
  ~Stepper();

  /// Takes one accepted step and returns ARKODE's code (see OutcomeOfReturnCode). On success t and
  /// y() are the step's end; a step that reaches t_end or a stop time ends there exactly.
  int Step(double& t);

  /// Starts anew from (t, y), t < t_end, with the step size meant for the next step.
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
