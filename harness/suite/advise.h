// The cheapest method for an error bound, chosen by trials.
#pragma once

#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "harness/config/experiment.h"
#include "harness/observers/reference.h"
#include "mechanism/description/outcome.h"

namespace loopbench::harness {

// Runs one mechanism with many methods, times each run, and measures its error.

/// A way of running a mechanism.
struct Choice {
  Method method;
  std::string integrator = "ode45";
  double rtol = 1e-8;  ///< = atol; no effect with a fixed step
  double step = 0.0;   ///< [s], fixed; 0: adaptive

  friend bool operator==(const Choice&, const Choice&) = default;
};

/// "odca/projection/joint, verner at rtol 3e-08", "..., cash-karp in steps of 0.01 s".
std::string ToString(const Choice& choice);

struct Trial {
  Choice choice;
  Outcome outcome = Outcome::kFinished;
  /// Largest error over requested points and reference times [m]; infinite after a failure.
  double error = std::numeric_limits<double>::infinity();
  double late = 0.0, shape = 0.0;  ///< as error_phase_max [s] and error_path_max [m]
  double wall_s = 0.0;             ///< of the fastest bare run so far [s]
  std::int64_t steps = 0, rhs_evaluations = 0;
  std::string warnings;  ///< warnings of a run with all observers, if one was made
};

/// Inputs that all trials of a mechanism share.
struct TrialProblem {
  const MechanismDescription& user;
  const Reference& reference;
  double horizon;                     ///< [s], not beyond the trust horizon
  std::vector<MeasuredPoint> points;  ///< empty: all
};

class TrialBench {
 public:
  virtual ~TrialBench() = default;
  /// Times a bare run and measures a second one, unless it takes more CPU time than `cpu_s`.
  virtual Trial Try(const Choice& choice, double cpu_s) = 0;
  /// Another bare run: lowers the trial's wall_s if it was faster.
  virtual void Remeasure(Trial* trial) = 0;
  /// The time of a short run is soon disturbed: it is timed again until it falls no more.
  void Settle(Trial* trial);
};

/// Returns the bench for the mechanism with default options, as one subsystem. `problem` and its
/// referents must outlive the bench. Throws std::runtime_error if the initial assembly fails.
std::unique_ptr<TrialBench> MakeTrialBench(const TrialProblem& problem);

/// Returns a sentence that names the main source of a trial's error.
std::string WhatLimits(const Trial& trial, double reference_error);

// Finds the cheapest method for an error bound, or the most accurate one for a time budget.
//
// Formulations compute the same accelerations. The search therefore chooses tolerances per method
// and level in the fastest formulation. The best few then run with all formulations and both
// coordinate sets. A trial is stopped once it costs significantly more than the best known.

/// Trials must stay below this share of the requested error. Errors may be larger between a
/// reference's times, and the last bits of another machine change them.
inline constexpr double kErrorShare = 0.7;

struct AdviceRequest {
  std::optional<double> error;   ///< that must be kept [m]; else
  std::optional<double> budget;  ///< wall seconds per simulated second
  double cpu_s = 60.0;           ///< of the pilot [s]
};

struct Advice {
  bool reached = false;          ///< True if the first finalist meets the request
  std::vector<Trial> finalists;  ///< best first; nearest to the bound if none meets it
  /// The best trial of each method and level that the pilot looked at, in their order.
  std::vector<Trial> looked_at;
  /// The fastest generated run with the first finalist's settings, if requested and finished.
  std::optional<Trial> generated;
  int trials = 0;
  int untried = 0;       ///< that a sweep's time left out
  double pilot_s = 0.0;  ///< wall time of all of it [s]
};

/// `length` [m] is the length of a link. `examine` runs a choice with all observers and enters its
/// warnings and its error. A finalist with warnings is excluded unless all have some.
Advice Advise(const AdviceRequest& request, TrialBench& bench, double horizon, double length,
              const std::function<void(Trial&)>& examine);

/// Returns advice from all combinations of formulation, level, coordinates, profile and tolerance
/// (a decade apart; with a budget, two fixed steps a decade). It is the reference for tests of the
/// pilot. Runs stop only at twenty times the best or the budget, or at a tenth of the time.
Advice Sweep(const AdviceRequest& request, TrialBench& bench, double horizon, double length,
             const std::function<void(Trial&)>& examine);

}  // namespace loopbench::harness
