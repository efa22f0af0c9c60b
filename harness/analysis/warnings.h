// Warnings about runs: agreement between runs, tolerance refinement, drift growth.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "harness/record/record.h"
#include "mechanism/formulation/options.h"

namespace loopbench::harness {

// Compares the final poses of runs of one problem. Drift and energy do not reveal a wrong branch; a
// comparison with other runs does.

/// Final poses are alike that differ by at most so many tolerances: over links and in rad.
inline constexpr double kMaxTolerances = 1000.0;

struct Agreement {
  /// Runs of the same problem, horizon and tolerance with equal numbers have equal final poses. The
  /// largest such set is 1. 0 if there is no other run to compare with.
  std::int64_t cluster = 0;
  bool flagged = false;
  /// Agrees with a trusted run whose level restores the branch at every step.
  bool is_backed = false;
};

/// Returns one entry per record, in order. Compares finished accuracy runs of one problem
/// (`problem_id`: its full content) and horizon. Fixed-step runs are excluded because they give no
/// scale for a small difference.
///
/// If final poses differ at one tolerance, all these runs get a warning. The majority may be wrong:
/// formulations at one level make equal mistakes. A finer tolerance decides if all its runs agree
/// and cover several levels or coordinate sets. Then only the coarser runs that differ from it are
/// flagged. Integrators have different errors at one tolerance: if exactly one integrator's runs
/// all agree, they decide for that tolerance. Engines with compliant constraints
/// (FormulationRow::is_soft) are compared but not used as evidence.
///
/// Only trusted runs decide, one flag for each record: runs with own warnings are only compared. If
/// no run is trusted, all decide.
std::vector<Agreement> CompareFinalPoses(std::span<const Record> records,
                                         const std::vector<bool>& testifies);
/// Compares with all runs trusted.
std::vector<Agreement> CompareFinalPoses(std::span<const Record> records);

/// Returns true if an external engine made the run.
bool IsPeer(const Record& record);

/// Largest difference of final poses, and its body: lengths over the link length, angles in rad,
/// axes unscaled. Infinite if a number is missing or not finite.
struct PoseDifference {
  double largest = 0.0;
  std::string body;
};
/// Largest differences of the poses of bodies that occur in both records.
PoseDifference DifferenceOf(const Record& a, const Record& b);
/// Returns the largest difference between any two of `runs` of one problem, in any order.
PoseDifference LargestDifference(std::span<const Record> runs);

// Reasons not to rely on a finished run: warnings from its own record and from other runs of its
// problem (warnings.h).

/// The codes of `warnings` (docs/reference/outcomes-and-warnings.md); programs may rely on them.
inline constexpr const char* kEnergyWarning = "energy";
inline constexpr const char* kSingularWarning = "singular-crossing";
inline constexpr const char* kRegularizedWarning = "regularized";
inline constexpr const char* kDriftWarning = "drift";
inline constexpr const char* kMembersWarning = "ensemble-failures";
inline constexpr const char* kExponentWarning = "exponent";
inline constexpr const char* kDisagreementWarning = "disagreement";

inline constexpr const char* kErrorWarning = "error";
inline constexpr const char* kRefinementWarning = "refinement";
inline constexpr const char* kDriveWarning = "drive";
inline constexpr const char* kStepsWarning = "steps";

/// Returns the expected drift growth at the record's level; empty for unknown levels.
std::optional<DriftGrowth> GrowthAt(const Record& record);

/// Return the largest energy balance error over the exchanged energy (`energy_scale`; in records
/// without it the largest kinetic energy), and the share expected from tolerance and steps. NaN if
/// not measured.
double EnergyErrorShare(const Record& record);
double ExpectedEnergyShare(const Record& record);

/// Return the drift of a run and the drift expected at its level, both over a link length, or in
/// rad if rotations drift further. NaN if not measured.
///
/// A step of tolerance rtol leaves errors of about rtol in positions and speeds (docs/theory/
/// constraints-and-drift.md). At velocity level position errors add up to n rtol. At acceleration
/// level speed errors persist: n^2 rtol times the angle per step. Baumgarte feedback damps all but
/// the last steps; projection leaves round-off, and some tolerance in regularized directions. Fixed
/// steps have no expected drift except with projection.
double DriftShare(const Record& record);
double ExpectedDriftShare(const Record& record);

/// Returns the largest global error of points over the link length; NaN without a reference.
double TrueErrorShare(const Record& record);
/// Returns the longest step in periods of the fastest driver; NaN without a driver. Fewer than two
/// samples per period cause aliasing.
double PeriodsPerStep(const Record& record);

/// Returns the warning codes from an accuracy record alone, separated by spaces. Returns "" if
/// there are none or if the run did not finish.
std::string OwnWarnings(const Record& record);

/// Sets `warnings` of every finished accuracy record, including warnings from comparisons of runs.
/// Sets `agreement`: the runs of equal problem, horizon and tolerance with equal final poses.
void SetWarnings(std::vector<Record>* records);

/// Returns true if the record has warning `code`, or any warning if `code` is "".
bool HasWarning(const Record& record, const std::string& code = "");

}  // namespace loopbench::harness
