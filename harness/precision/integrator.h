// One-step methods in any scalar, with their step-size control.
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "mechanism/description/outcome.h"

namespace loopbench::harness {

// One-step methods with the step-size control of profile `ode45`, in any scalar.
//
// The Dormand-Prince pair, MATLAB's norm (max_i |e_i| / max(rtol |y_i|, atol)), first step, longest
// step and I controller, as harness/config/options.h has them for ARKODE. In double the two take
// the same steps except for rounding. Times, tolerances and coefficients have the scalar of the
// state.
//
// A reference far below the reach of order 5 comes from Gragg's method: the modified midpoint rule
// with 2, 4, .., 20 substeps, extrapolated to order 20 by Aitken and Neville (Hairer, Norsett,
// Wanner, Solving Ordinary Differential Equations I, section II.9), under the same controller. The
// weights of ten columns add up to 550 and amplify round-off by that factor; of seven, to 56.

/// y' = f(t, y).
template <class S>
struct Problem {
  int size = 0;
  /// Writes f(t, y); anything but kFinished ends the run. Values that are not finite do so too.
  std::function<Outcome(S t, std::span<const S> y, std::span<S> ydot)> derivative;
  /// Called at the start and every accepted step. Returns true if it has changed y.
  std::function<bool(S t, std::span<S> y)> accept;
};

enum class OneStepMethod { kDormandPrince, kGragg };
inline constexpr int kMaxColumns = 10;  ///< of Gragg's extrapolation, each worth two orders

template <class S>
struct OneStepOptions {
  OneStepMethod method = OneStepMethod::kDormandPrince;
  S tolerance = S(1e-6);  ///< rtol = atol > 0
  int columns = kMaxColumns;
  S fixed_step = S(0);    ///< positive: every step but the last has this length, untested
  S begin = S(0);         ///< [s]
  S first_step = S(0);    ///< 0: found by the profile's rule
  S longest_step = S(0);  ///< 0: a tenth of the interval
  std::int64_t step_limit = 10'000'000;
  /// Error tests a step may fail before the run ends; ARKODE's, not the 60 of runs in double
  /// (integrator/arkode.cpp): where rounding in float cannot meet a tolerance, more halvings find
  /// steps that pass by chance, and a run crawls instead of ending.
  int most_failures = 7;
  /// A stage without a derivative fails the error test, else it ends the run.
  bool steps_around_failures = false;
  double time_limit_s = 600.0;  ///< CPU time of the thread, looked at after each step
};

/// Result of a run.
struct OneStepResult {
  Outcome outcome = Outcome::kFinished;
  double t_reached = 0.0;  ///< [s]
  std::int64_t steps = 0, rejected = 0, rhs_evaluations = 0, restarts = 0;
  double next_step = 0.0;  ///< that would have come next, were the last one not clipped [s]
};

/// From options.begin to t_end [s] behind it; y is the state at t_reached afterwards. A step that
/// fails its error test too often, or an accepted one of at most 16 eps t, ends the run as
/// step-too-small.
template <class S>
OneStepResult IntegrateSystem(const Problem<S>& system, S t_end, std::vector<S>& y,
                              const OneStepOptions<S>& options);

}  // namespace loopbench::harness
