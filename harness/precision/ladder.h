// The precision study: one mechanism and formulation in float, double, long double and float128,
// with one integrator (integrator.h), against a reference in float128.
//
// Error and drift of a run have two parts: round-off and truncation. Truncation remains in the
// widest scalar at the same tolerance: the method's error, and the error of regularization.
//
// All methods of a mechanism share one reference, because the exact motion is the same: multipliers
// in joint coordinates, positions projected after each step, without regularization.
#pragma once

#include <array>
#include <string>
#include <string_view>
#include <vector>

#include "harness/config/experiment.h"
#include "harness/precision/integrator.h"
#include "mechanism/description/outcome.h"

namespace loopbench::harness {

/// The formulations that are compiled in all scalars.
inline constexpr std::array<std::string_view, 3> kLadderFormulations = {"odca", "lagrange",
                                                                        "reduction"};

/// One mechanism, one method, and the scalars to run.
struct LadderTask {
  MechanismDescription description;  ///< planar, no tables of time
  Method method;                     ///< with one of kLadderFormulations
  double horizon = 1.0;              ///< [s]
  Precision precision;               ///< scalars, tolerances, the reference's
  Limits limits;                     ///< CPU time and steps, of each run
};

/// One run in one scalar.
struct SweepLevel : OneStepResult {
  Scalar scalar = Scalar::kDouble;
  double tolerance = 0.0;
  double wall_s = 0.0, cpu_s = 0.0;
  double drift = 0.0;  ///< largest violation of points at accepted steps [m]
  double error = 0.0;  ///< largest distance of a centre of mass from the reference at the end [m];
                       ///< NaN if either run failed
  /// "truncation", "round-off", or "" if undecided.
  std::string error_ruled_by, drift_ruled_by;
};

struct Ladder {
  Outcome start = Outcome::kFinished;  ///< otherwise nothing was run
  std::string message;
  std::vector<SweepLevel> rungs;  ///< by scalar, then by tolerance, in the order of the task
  /// In float128 by Gragg's method. Its error is the distance from a second reference with a
  /// tolerance 10^4 times as large; its drift uses its own coordinates.
  SweepLevel reference;
};

/// Mismatches and distances are measured in float128 on the mechanism as described, whatever the
/// run's scalar; all runs start from one point that closes the loops in float128, rounded to their
/// scalar.
Ladder RunLadder(const LadderTask& task);

/// Returns the dominant part of a number (error or drift) that is `own` in one scalar and `widest`
/// in the widest that finished at the same tolerance. Round-off if the two differ by more than a
/// factor of two (by chance it may cancel truncation too), else truncation; "" if one is NaN. The
/// next wider scalar is not used: neighbours may fail alike. For the widest, the next narrower one
/// bounds the round-off. Truncation dominates if its number exceeds ten times the narrower one's
/// scaled by the ratio of their eps.
std::string_view DominatedBy(double own, double widest);

}  // namespace loopbench::harness
