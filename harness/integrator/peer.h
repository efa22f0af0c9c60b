// A peer: somebody else's program that moves a whole mechanism by its own equations, integrator and
// projection. Here it stands where a formulation and ARKODE stand otherwise; what it makes of a
// mechanism is looked at by the same observers (docs/decisions/018).
#pragma once

#include <stdexcept>
#include <vector>

#include "harness/integrator/arkode.h"

namespace loopbench::harness {

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
