// Which way of running a mechanism is the cheapest that keeps an error, or the most accurate that
// keeps a budget: a pilot of short trials, and what they showed.
//
// Formulations compute the same accelerations, so what a method errs at a tolerance hardly depends
// on them, and what an evaluation costs hardly on the method. The pilot looks for tolerances, by
// method and level, in the formulation whose evaluations are the fastest; the best few are then run
// by all formulations in both coordinate sets, in turn, and timed again until the fastest is known.
// A trial is cut off as soon as it costs more than the best known by more than chance.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "harness/advise/trials.h"

namespace loopbench::harness {

/// Trials must stay below this share of the requested error. Errors may be larger between a
/// reference's times, and the last bits of another machine change them.
inline constexpr double kErrorShare = 0.7;

struct AdviceRequest {
  std::optional<double> error;   ///< that must be kept [m]; else
  std::optional<double> budget;  ///< wall seconds per simulated second
  double cpu_s = 60.0;           ///< of the pilot [s]
};

struct Advice {
  bool reached = false;          ///< whether the first finalist keeps what was asked for
  std::vector<Trial> finalists;  ///< the best first; where nothing was reached, the nearest first
  /// The best trial of each method and level that the pilot looked at, in their order.
  std::vector<Trial> looked_at;
  /// The fastest generated run with the first finalist's integrator, level and tolerance, if it was
  /// requested and finished.
  std::optional<Trial> generated;
  int trials = 0;
  int untried = 0;       ///< that a sweep's time left out
  double pilot_s = 0.0;  ///< wall time of all of it [s]
};

/// `length` [m] is the length of a link. `examine` runs a choice with all observers and enters its
/// warnings and its error. A finalist with doubts is no advice unless all have some.
Advice Advise(const AdviceRequest& request, TrialBench& bench, double horizon, double length,
              const std::function<void(Trial&)>& examine);

/// The same from the whole product of formulations, levels, coordinates, profiles and tolerances a
/// decade apart (and with a budget fixed steps, two a decade): what a pilot is held against.
/// Nothing is cut off but runs that take twenty times the best or the budget, or a tenth of the
/// time.
Advice Sweep(const AdviceRequest& request, TrialBench& bench, double horizon, double length,
             const std::function<void(Trial&)>& examine);

}  // namespace loopbench::harness
