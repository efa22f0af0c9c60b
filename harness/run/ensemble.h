// Runs from perturbed starts, and records of parts as one.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "harness/analysis/growth.h"
#include "harness/config/experiment.h"
#include "harness/record/record.h"

namespace loopbench::harness {

// One record from the runs of parts that have nothing to do with each other.

/// What one run leaves behind.
struct Run {
  Record record;
  DriftSeries drift;
  /// Of the projections [m] and of the energy balance [J], with the largest kinetic energy [J].
  DriftSeries correction = {}, energy = {};
  double kinetic = 0.0;
  /// The scene's branch combinations (mechanism_reader.h) at the assembled start [rad]; empty
  /// without.
  std::vector<double> branch_start = {};
};

/// Each part has its own steps. Work adds up (steps, evaluations, wall time, rank); drift is the
/// largest of the parts, at each time the largest of what each had last; the worst outcome and the
/// earliest end count; energy errors and the energies that they are compared with add up, upper
/// bounds of the whole's. Series of corrections, energy and angles, which belong to one sequence of
/// steps, stay out.
Run MergeParts(std::span<const Run> parts);

// The members of an ensemble: where they start, and how many of them stay on their branch.

/// The description of one member: held coordinates moved by uniform random amounts of at most
/// `perturb`, or those that `between` names drawn uniformly between their bounds. The same seed and
/// member give the same start everywhere.
///
/// Loops stay on their branch: a start is reached in steps of at most 0.1 rad or m, each assembled
/// from the positions before it, extrapolated, which passes positions where branches cross. Shorter
/// ways take one step, the description's own guesses. Where a step cannot be closed the member has
/// the drawn coordinates and those guesses, and its run ends as inconsistent-start if they fail.
MechanismDescription MemberStart(const MechanismDescription& description, const Case& one,
                                 int member);

/// What becomes of the members; the unperturbed run is none of them.
class EnsembleTally {
 public:
  /// `nominal` is the unperturbed run, whose start tells the branch.
  EnsembleTally(const Run& nominal, double branch_bound)
      : branch_start_(nominal.branch_start), branch_bound_(branch_bound) {}

  /// `start` is what the member was run from.
  void Add(const Run& member, const MechanismDescription& start);

  /// ensemble_size, ensemble_failed (did not finish); of the members that finished the largest
  /// branch, closed-form, energy and drift errors, ensemble_<key>, where the scene knows them; and
  /// where it knows a branch ensemble_branch_bound [rad], ensemble_branch_kept (finished, started
  /// on the branch, and never further from it than that), ensemble_started_off (on another branch,
  /// finished or not). A largest error that is not finite is kept as such. ensemble_first_failed
  /// and ensemble_first_left (finished, but not kept) name the first such member, its start
  /// with all digits, and its ending.
  void Write(Record& record) const;

 private:
  bool StartsOnBranch(const Run& member) const;
  void KeepLargest(const Record& record);

  std::vector<double> branch_start_;
  double branch_bound_;
  std::int64_t size_ = 0, failed_ = 0, kept_ = 0, started_off_ = 0;
  std::string first_failed_, first_left_;
  Record largest_;
};

}  // namespace loopbench::harness
