// Runs from perturbed starts, and records of parts as one.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "harness/analysis/growth.h"
#include "harness/config/experiment.h"
#include "harness/record/record.h"

namespace loopbench::harness {

// Merges the runs of independent parts into one record.

/// Results of one run.
struct Run {
  Record record;
  DriftSeries drift;
  /// Corrections of projections [m], energy balance [J] and largest kinetic energy [J].
  DriftSeries correction = {}, energy = {};
  double kinetic = 0.0;
  bool is_redundant = false;  ///< has constraints that others imply
  /// The problem's branch combinations (mechanism_reader.h) at the assembled start [rad], or empty.
  std::vector<double> branch_start = {};
};

/// Merges the runs of subsystems, which have their own steps. Work is summed (steps, evaluations,
/// wall time, rank). Drift is the maximum over the parts, at each time of each part's last value.
/// The worst outcome and the earliest end count. Energy errors and their reference energies are
/// summed (upper bounds). Series of corrections, energy and angles belong to one step sequence and
/// are omitted.
Run MergeParts(std::span<const Run> parts);

// Members of an ensemble: their starts, and the number that stay on their branch.

/// Returns the description of one member: fixed coordinates moved by uniform random amounts of at
/// most `perturb`, or coordinates in `between` drawn uniformly between their bounds. The same seed
/// and member give the same start everywhere.
///
/// Loops stay on their branch: a start is reached in steps of at most 0.1 rad or m. Each is
/// assembled from the extrapolated previous positions, which passes positions where branches cross.
/// Shorter paths take one step, with the description's own guesses. If a step cannot be closed, the
/// member has the drawn coordinates and those guesses; its run ends as inconsistent-start if they
/// fail.
MechanismDescription MemberStart(const MechanismDescription& description, const Case& entry,
                                 int member);

/// Statistics of the members, without the unperturbed run.
class EnsembleTally {
 public:
  /// `nominal` is the unperturbed run; its start determines the branch.
  EnsembleTally(const Run& nominal, double branch_bound)
      : branch_start_(nominal.branch_start), branch_bound_(branch_bound) {}

  /// `start` is the member's initial state.
  void Add(const Run& member, const MechanismDescription& start);

  /// Writes ensemble_size and ensemble_failed (did not finish). For finished members with a known
  /// solution, writes the largest branch, closed-form, energy and drift errors as ensemble_<key>.
  /// If a branch is known, adds ensemble_branch_bound [rad], ensemble_branch_kept (finished,
  /// started on the branch, never further from it than the bound) and ensemble_started_off (on
  /// another branch, finished or not). Keeps non-finite largest errors. ensemble_first_failed and
  /// ensemble_first_left (finished, not kept) give the first such member, its start with all
  /// digits, and its outcome.
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
