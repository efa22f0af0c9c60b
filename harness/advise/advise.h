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
#include "harness/reference/reference.h"
#include "mechanism/description/outcome.h"

namespace loopbench::harness {

// Runs of one mechanism in many ways, each timed bare and then held against the reference: what
// advice is made of.

/// A way of running a mechanism.
struct Choice {
  Column column;
  std::string integrator = "ode45";
  double rtol = 1e-8;  ///< = atol; of no consequence where the step is fixed
  double step = 0.0;   ///< [s], fixed; 0: adaptive

  friend bool operator==(const Choice&, const Choice&) = default;
};

/// "odca/projection/joint, verner at rtol 3e-08", "..., cash-karp in steps of 0.01 s".
std::string ToString(const Choice& choice);

struct Trial {
  Choice choice;
  Outcome outcome = Outcome::kFinished;
  /// Largest of the points asked for, over the reference's times [m]; infinite for one that failed.
  double error = std::numeric_limits<double>::infinity();
  double late = 0.0, shape = 0.0;  ///< as error_phase_max [s] and error_path_max [m]
  double wall_s = 0.0;             ///< of the fastest bare run so far [s]
  std::int64_t steps = 0, rhs_evaluations = 0;
  std::string doubts;  ///< of a run with all observers, where one was made
};

/// What all trials of a mechanism share.
struct TrialScene {
  const MechanismDescription& user;
  const Reference& reference;
  double horizon;                     ///< [s], not beyond the trust horizon
  std::vector<MeasuredPoint> points;  ///< empty: all
};

class TrialBench {
 public:
  virtual ~TrialBench() = default;
  /// A bare run, timed, and one that is measured. A run that takes more CPU time than `cpu_s` ends
  /// with kTimeLimit and is not measured.
  virtual Trial Try(const Choice& choice, double cpu_s) = 0;
  /// Another bare run: lowers the trial's wall_s if it was faster.
  virtual void TimeAgain(Trial* trial) = 0;
  /// The time of a short run is soon disturbed: it is timed again until it falls no more.
  void Settle(Trial* trial);
};

/// The mechanism as runs have it by default, in one piece. `scene` and what it refers to must
/// outlive the bench. Throws std::runtime_error where the start cannot be assembled.
std::unique_ptr<TrialBench> MakeTrialBench(const TrialScene& scene);

/// What a trial's error is made of, as a sentence.
std::string WhatLimits(const Trial& trial, double reference_error);

// Which way of running a mechanism is the cheapest that keeps an error, or the most accurate that
// keeps a budget: a pilot of short trials, and what they showed.
//
// Formulations compute the same accelerations, so what a method errs at a tolerance hardly depends
// on them, and what an evaluation costs hardly on the method. The pilot looks for tolerances, by
// method and level, in the formulation whose evaluations are the fastest; the best few are then run
// by all formulations in both coordinate sets, in turn, and timed again until the fastest is known.
// A trial is cut off as soon as it costs more than the best known by more than chance.

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
