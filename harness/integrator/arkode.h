// Runge-Kutta integration by ARKODE, with named profiles and named endings.
//
// SUNDIALS appears only in arkode.cpp and the files arkode_*; this header is what the rest of the
// harness sees.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "harness/config/options.h"
#include "harness/integrator/dense_output.h"
#include "harness/integrator/ode.h"
#include "mechanism/description/outcome.h"

namespace loopbench::harness {

/// What happened. Counters refer to the whole run, restarts included.
struct IntegratorResult {
  Outcome outcome = Outcome::kFinished;
  std::string message;               ///< why it ended early; empty if the end was reached
  double t_reached = 0;              ///< time of the last accepted step, s
  std::int64_t steps = 0;            ///< accepted steps
  std::int64_t rejected = 0;         ///< steps that failed the error test
  std::int64_t rhs_evaluations = 0;  ///< calls of Ode::Derivative, the failing one included
  std::int64_t restarts = 0;         ///< times the observer asked for kRestart and was followed
  double last_step = 0;              ///< length of the last accepted step, s
  double wall_s = 0;                 ///< wall time of the run, observers included, s
  double cpu_s = 0;                  ///< CPU time of its thread, s

  // Implicit profiles only, else 0:
  std::int64_t jacobians = 0;                 ///< Jacobians evaluated
  std::int64_t jacobian_rhs_evaluations = 0;  ///< derivatives for them, those of difference
                                              ///< quotients above all; not in rhs_evaluations
  std::int64_t dual_evaluations = 0;          ///< of a problem with Jacobians of its own
  std::int64_t newton_iterations = 0;         ///< of all stages, each with a call of Derivative
  std::int64_t newton_failures = 0;           ///< stages that did not converge, the step shortened
};

/// Integrates from (t0, y) to t_end >= t0 and leaves in `y` the last accepted state, whatever the
/// outcome. The last step is clipped so that its end is t_end: the final state is a step's own end
/// like every other. (A step that ends within 100 round-offs of t_end counts as ending there.)
/// An observer that stops the run gives kFinished with t_reached < t_end.
///
/// Nothing is allocated per step or per derivative, and equal calls give equal bits. `dense`,
/// unless null, is shown the solution at the times it asks for, which changes no bit of the run:
/// its derivatives are not counted. Times that the run does not reach are not shown, nor those in a
/// step where a derivative for it fails.
///
/// @throws std::invalid_argument if Validate() finds fault, y has the wrong size, or t_end < t0.
/// Exceptions of `ode` and of `observe` pass through.
IntegratorResult Integrate(Ode& ode, double t0, double t_end, std::vector<double>& y,
                           const IntegratorOptions& options, const StepObserver& observe = {},
                           const DenseObserver* dense = nullptr);

/// The one table from ARKODE's return codes (ARK_... in arkode.h of SUNDIALS) to outcomes:
/// 0 and 1 (step taken, stop time reached) and 99 (warning) are kFinished; -1 (too much work) is
/// kStepLimit; -3 (error test failed too often in one step) is kStepTooSmall; -4 and -31 (Newton's
/// iteration failed too often in one step, or at all with a fixed one) are kNewtonFailure; every
/// other code is kIntegratorError. A failure of the derivative (-8 to -11) is reported as what the
/// derivative returned, and is kIntegratorError here because the code alone does not say.
Outcome OutcomeOfReturnCode(int code);

}  // namespace loopbench::harness
