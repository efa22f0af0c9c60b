// Runs of one mechanism in many ways, each timed bare and then held against the reference: what
// advice is made of.
#pragma once

#include <cstdint>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "harness/config/experiment.h"
#include "harness/reference/reference.h"
#include "mechanism/description/outcome.h"

namespace loopbench::harness {

/// A way of running a mechanism.
struct Choice {
  Column column;
  std::string integrator = "ode45";
  double rtol = 1e-8;  ///< = atol; of no consequence where the step is fixed
  double step = 0.0;   ///< [s], fixed; 0: adaptive

  friend bool operator==(const Choice&, const Choice&) = default;
};

/// "odca/position/joint, verner at rtol 3e-08", "..., cash-karp in steps of 0.01 s".
std::string ToString(const Choice& choice);

struct Trial {
  Choice choice;
  Outcome outcome = Outcome::kFinished;
  /// Largest of the points asked for, over the reference's times [m]; infinite for one that failed.
  double error = std::numeric_limits<double>::infinity();
  double late = 0.0, shape = 0.0;  ///< as error_phase_max [s] and error_shape_max [m]
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

}  // namespace loopbench::harness
