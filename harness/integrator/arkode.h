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

// Interface between the integrator, a problem and its observers. No SUNDIALS here.

/// The problem (mechanism/formulation/ode.h), in ARKODE's scalar.
using Ode = loopbench::Ode<double>;

/// Action of the run after an observation.
enum class StepAction {
  kContinue,  ///< continue; changes made to y are ignored
  kRestart,   ///< y, or the meaning of its components, has changed: forget f(t, y), keep the step
              ///< size
  kStop,      ///< end the run here, successfully
};

/// Called with the start point and then with every accepted step, in order of time. The state is
/// the integrator's own solution there, never an interpolated one: sampling drift at interpolated
/// points changes it by up to five orders of magnitude. An empty function observes nothing.
using StepObserver = std::function<StepAction(double t, std::span<double> y)>;

// Dense output: the solution between the ends of a step.
//
// A polynomial of degree 5 through the ends of a step and their derivatives, improved twice by
// derivatives at its own points (W. Enright, K. Jackson, S. Norsett, P. Thomsen, Interpolants for
// Runge-Kutta formulas, ACM Trans. Math. Softw. 12, 1986). Its error is of order h^6; the
// polynomial of one degree less has order h^5. With ARKODE 6.4's own a run would depend on its
// observers.

/// f(t, y) to `ydot`; false when it cannot be had.
using DenseDerivative =
    std::function<bool(double t, std::span<const double> y, std::span<double> ydot)>;

/// Receiver of the solution at times between the ends of steps.
struct DenseObserver {
  std::vector<double> times;  ///< [s], rising
  /// Receives times[k] and the solution there. `lower` has one degree less: the difference bounds
  /// the interpolation error. At the end of a step both are the state that the observer left.
  std::function<void(std::size_t k, std::span<const double> y, std::span<const double> lower)>
      observe;
  /// Derivative for dense output, if counted separately; null uses the problem's own.
  DenseDerivative derivative = nullptr;
};

class DenseOutput {
 public:
  using Derivative = DenseDerivative;

  /// Prepares the step from (t0, y0) to (t1, y1), t0 < t1, by five derivatives. That at t1 is taken
  /// just before it, so that jumps belong to the next step. Returns false if one fails.
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

// Runge-Kutta integration by ARKODE, with named profiles and outcomes.
//
// SUNDIALS appears only in arkode.cpp; the rest of the harness includes this header.

/// Outcome of a run. Counters refer to the whole run, restarts included.
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
  std::int64_t jacobian_rhs_evaluations = 0;  ///< derivatives for Jacobians (mostly difference
                                              ///< quotients); not in rhs_evaluations
  std::int64_t dual_evaluations = 0;          ///< for problems with their own Jacobians
  std::int64_t newton_iterations = 0;         ///< of all stages, each with a call of Derivative
  std::int64_t newton_failures = 0;           ///< stages that did not converge, the step shortened
};

/// Integrates from (t0, y) to t_end >= t0 and leaves the last accepted state in `y` for every
/// outcome. The last step is clipped to end at t_end. (A step that ends within 100 round-offs of
/// t_end counts as ending there.) If an observer stops the run, the outcome is kFinished with
/// t_reached < t_end.
///
/// Allocates nothing per step or derivative; equal calls give equal bits. `dense`, unless null,
/// receives the solution at its times without changing the run: its derivatives are not counted. It
/// receives no times after the end of the run or in a step where a derivative for it fails.
///
/// @throws std::invalid_argument if Validate() fails, y has the wrong size, or t_end < t0.
/// Exceptions of `ode` and of `observe` pass through.
IntegratorResult Integrate(Ode& ode, double t0, double t_end, std::vector<double>& y,
                           const IntegratorOptions& options, const StepObserver& observe = {},
                           const DenseObserver* dense = nullptr);

/// Returns the outcome of a return code of ARKODE. A failure of the derivative is kIntegratorError
/// here, because the code alone is ambiguous; a run reports the derivative's own outcome.
Outcome OutcomeOfReturnCode(int code);

// An external engine: a program with its own equations, integrator and projection. It replaces the
// formulation and ARKODE; its states are evaluated by the same observers (docs/decisions/018).

/// Built for one mechanism. Its state y = (q, u) has the joint coordinates and speeds of
/// Mechanism(description, Coordinates::kJoint), in their order; Derivative() returns (N(q) u, udot)
/// by the engine's equations alone.
class Peer : public Ode {
 public:
  /// Integrates like Integrate() of arkode.h, from time 0. `y` is observed at the start and after
  /// each accepted and projected step, and is the last such state at the end. The relative
  /// tolerance (interpreted by the engine), step limits and time limits apply. An observer may stop
  /// the run and otherwise changes nothing.
  virtual IntegratorResult Integrate(double t_end, std::vector<double>& y,
                                     const IntegratorOptions& options,
                                     const StepObserver& observe) = 0;
};

/// Thrown by who makes a peer, with the joint or force that the peer does not have.
class Inexpressible : public std::runtime_error {
  using std::runtime_error::runtime_error;
};

}  // namespace loopbench::harness
