// Integration by ARKODE: the equations, its options, output between steps, peers.
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include "harness/config/options.h"
#include "mechanism/description/outcome.h"
#include "mechanism/formulation/ode.h"

namespace loopbench::harness {

// What the integrator needs to know of a problem, and what it tells an observer. No SUNDIALS here.

/// The problem (mechanism/formulation/ode.h), in ARKODE's scalar.
using Ode = loopbench::Ode<double>;

/// What the run does after an observation.
enum class StepAction {
  kContinue,  ///< go on; changes made to y are ignored
  kRestart,   ///< y, or the meaning of its components, has changed: forget f(t, y), keep the step
              ///< size
  kStop,      ///< end the run here, successfully
};

/// Called with the start point and then with every accepted step, in order of time. The state is
/// the integrator's own solution there, never an interpolated one: sampling drift at interpolated
/// points changes it by up to five orders of magnitude. An empty function observes nothing.
using StepObserver = std::function<StepAction(double t, std::span<double> y)>;

// The solution between the ends of a step.
//
// A polynomial of degree 5 through the ends of a step and their derivatives, made better twice by
// derivatives at its own points (bootstrapping: W. Enright, K. Jackson, S. Norsett, P. Thomsen,
// Interpolants for Runge-Kutta formulas, ACM Trans. Math. Softw. 12, 1986). Its error is of order
// h^6, that of one degree less, which stands beside it, of order h^5. ARKODE's own interpolant of
// that degree is of the same kind, but 6.4 also asks it for the state at every stop time and would
// then evaluate derivatives there, so that a run would depend on who watches it.

/// f(t, y) to `ydot`; false when it cannot be had.
using DenseDerivative =
    std::function<bool(double t, std::span<const double> y, std::span<double> ydot)>;

/// Where the solution is wanted besides the steps' ends.
struct DenseObserver {
  std::vector<double> times;  ///< [s], rising
  /// times[k] with the solution there. `lower` is of one degree less: their difference bounds what
  /// interpolation adds. At the end of a step both are the step's own end as the observer left it.
  std::function<void(std::size_t k, std::span<const double> y, std::span<const double> lower)>
      observe;
  /// The problem's derivative, where those taken here are to be told from the integrator's; else
  /// the problem is asked itself.
  DenseDerivative derivative = nullptr;
};

class DenseOutput {
 public:
  using Derivative = DenseDerivative;

  /// The step from (t0, y0) to (t1, y1), t0 < t1. Five derivatives, of which that at t1 is taken at
  /// the last time before it: what jumps there is the next step's. False when one cannot be had.
  bool Prepare(double t0, std::span<const double> y0, double t1, std::span<const double> y1,
               const Derivative& derivative);

  /// The solution at t in [t0, t1], and the one of a degree less.
  void At(double t, std::span<double> y, std::span<double> lower) const;

 private:
  /// The cubic through both ends and their derivatives, at theta = (t - t0) / h.
  void Cubic(double theta, std::span<double> y) const;

  double t0_ = 0.0, h_ = 0.0;
  std::vector<double> y0_, y1_, f0_, f1_;  ///< derivatives times h
  std::vector<double> bump_, flat_,
      sloping_;  ///< factors of w, of the lower degree and of the full
};

// Runge-Kutta integration by ARKODE, with named profiles and named endings.
//
// SUNDIALS appears only in arkode.cpp and the files arkode_*; this header is what the rest of the
// harness sees.

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

// A peer: somebody else's program that moves a whole mechanism by its own equations, integrator and
// projection. Here it stands where a formulation and ARKODE stand otherwise; what it makes of a
// mechanism is looked at by the same observers (docs/decisions/018).

/// Made for one mechanism. Its state y = (q, u) has the joint coordinates and speeds of
/// Mechanism(description, Coordinates::kJoint), in their order; Derivative() gives (N(q) u, udot)
/// by the peer's equations alone.
class Peer : public Ode {
 public:
  /// As Integrate() of arkode.h, from time 0: `y` is observed at the start and after each step that
  /// the peer accepts and projects, and is the last such state at the end. Of the options the
  /// relative tolerance (what the peer makes of it is its own), step and time limits count. An
  /// observer may stop the run and otherwise changes nothing.
  virtual IntegratorResult Integrate(double t_end, std::vector<double>& y,
                                     const IntegratorOptions& options,
                                     const StepObserver& observe) = 0;
};

/// Thrown by who makes a peer, with the joint or force that the peer does not have.
class Inexpressible : public std::runtime_error {
  using std::runtime_error::runtime_error;
};

}  // namespace loopbench::harness
