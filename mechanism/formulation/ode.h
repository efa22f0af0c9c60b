// Interface of a problem for an integrator.
#pragma once

#include <optional>
#include <span>

#include "mechanism/description/outcome.h"

namespace loopbench {

/// Work for a Jacobian computed by the problem.
struct JacobianWork {
  int derivatives = 0;       ///< evaluations of f
  int dual_evaluations = 0;  ///< evaluations with dual numbers, several columns at once
};

/// A system of first-order ordinary differential equations y' = f(t, y), t in seconds.
///
/// The object may keep scratch memory, so `Derivative` is not const; it must nevertheless be a
/// function of (t, y) alone between two restarts, because the integrator rejects steps and
/// evaluates stages out of order.
template <class S>
class Ode {
 public:
  virtual ~Ode() = default;

  /// Number of components of y; constant during a run.
  virtual int size() const = 0;

  /// Returns the number of last components of y that are quadratures: integrals along the motion,
  /// such as the work of a force, on which f does not depend. Fewer than size(), constant during a
  /// run. They do not affect the choice of steps: the other components have the same bits with and
  /// without them. Their own error is not controlled.
  virtual int num_quadratures() const { return 0; }

  /// Writes f(t, y) to `ydot`. Where f jumps in time (IntegratorOptions::stop_times) it is taken
  /// from the right: at a stop time itself this writes the limit from later times. Returns
  /// kFinished, or the failure that ends the run (kSingular,
  /// ...). The integrator checks for NaN and infinity itself, so no implementation need do so.
  virtual Outcome Derivative(S t, std::span<const S> y, std::span<S> ydot) = 0;

  /// For implicit methods: writes df_i/dy_j to `jacobian`[i + size() * j], i < size() and j <
  /// size() - num_quadratures(), where the entries are zero, and returns its work. Empty (the
  /// default) requests difference quotients of f. An approximation only slows Newton's iteration;
  /// it does not falsify the solution.
  virtual std::optional<JacobianWork> Jacobian(S /*t*/, std::span<const S> /*y*/,
                                               std::span<S> /*jacobian*/) {
    return std::nullopt;
  }
};

}  // namespace loopbench
