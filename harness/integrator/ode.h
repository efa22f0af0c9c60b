// What the integrator needs to know of a problem, and what it tells an observer. No SUNDIALS here.
#pragma once

#include <functional>
#include <span>

#include "mechanism/formulation/ode.h"

namespace loopbench::harness {

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

}  // namespace loopbench::harness
