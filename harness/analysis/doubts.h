// Doubts about runs: what agrees with what, what refinement and growth say.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "harness/record/record.h"
#include "mechanism/formulation/options.h"

namespace loopbench::harness {

// Whether runs of one scene end alike. Neither drift nor energy sees a run that took a wrong
// branch; the runs beside it do.

/// Final poses are alike that differ by at most so many tolerances: over links and in rad.
inline constexpr double kMostTolerances = 1000.0;

struct Agreement {
  /// Runs of the same scene, horizon and tolerance with the same number ended alike, the largest
  /// such set being 1; 0 for runs that have nobody to be compared with.
  std::int64_t cluster = 0;
  bool doubted = false;
  /// Ended as one that testifies and whose level puts the branch back at every step.
  bool is_backed = false;
};

/// One for each record, in their order. Compared are accuracy runs that finished, of one scene
/// (`problem_id`: its whole content) and horizon; but not those with a fixed step, which say of no
/// difference that it is small.
///
/// Where the runs at one tolerance do not all end alike, all of them are doubted. The majority need
/// not be right, because formulations at the same level make the same mistakes. A finer tolerance
/// decides, if all runs there end alike and are of more than one level or coordinate set: then only
/// those coarser runs are doubted that ended elsewhere. Integrators make different errors at one
/// tolerance: where all runs of one end alike, and no other one's all end alike elsewhere, they
/// decide for the rest of their tolerance too. Peers whose closures give way
/// (FormulationRow::is_soft) are held to the others' end and cast no doubt on it.
///
/// Only runs that testify decide, one flag for each record: who has reason to doubt itself is held
/// to the others' end. Where nobody testifies, all do.
std::vector<Agreement> CompareFinalPoses(std::span<const Record> records,
                                         const std::vector<bool>& testifies);
/// All testify.
std::vector<Agreement> CompareFinalPoses(std::span<const Record> records);

/// Whether another program made the run.
bool IsPeer(const Record& record);

/// The largest difference of final poses, and the body that has it: lengths over the link length,
/// angles in rad, axes as they are. Infinite where a number is missing or not finite.
struct PoseDifference {
  double largest = 0.0;
  std::string body;
};
/// Largest differences of the poses of bodies that occur in both records.
PoseDifference DifferenceOf(const Record& a, const Record& b);
/// The largest between any two of `runs` of one scene, in any order.
PoseDifference LargestDifference(std::span<const Record> runs);

// Reasons not to rely on a run although it finished: what its own record says against it, and what
// the other runs of its scene do (doubts.h).

/// The codes of `doubts` (docs/reference/outcomes-and-warnings.md); programs may rely on them.
inline constexpr const char* kEnergyDoubt = "energy";
inline constexpr const char* kSingularDoubt = "singular-crossing";
inline constexpr const char* kSoftenedDoubt = "regularized";
inline constexpr const char* kDriftDoubt = "drift";
inline constexpr const char* kMembersDoubt = "ensemble-failures";
inline constexpr const char* kExponentDoubt = "exponent";
inline constexpr const char* kDisagreementDoubt = "disagreement";

inline constexpr const char* kErrorDoubt = "error";
inline constexpr const char* kRefinementDoubt = "refinement";
inline constexpr const char* kDriveDoubt = "drive";
inline constexpr const char* kStepsDoubt = "steps";

/// How drift grows at the record's level; nothing for a level that this program does not know.
std::optional<DriftGrowth> GrowthAt(const Record& record);

/// Largest error of the energy balance over the energy that moves (`energy_scale`; in records
/// without it the largest kinetic energy), and the share that tolerance and steps explain. NaN
/// where it was not measured.
double EnergyErrorShare(const Record& record);
double ExpectedEnergyShare(const Record& record);

/// Drift of a run over the length of a link, or in rad where a rotation has drifted further, and
/// what its level of enforcement promises of it. NaN where it was not measured.
///
/// A step of tolerance rtol leaves errors of some rtol in positions and speeds (docs/theory/
/// constraints-and-drift.md). At velocity level those of positions add up, n rtol; at acceleration
/// level speeds keep theirs, n^2 rtol times the angle per step; Baumgarte's feedback forgets all
/// but the last steps; a projection leaves round-off, and in softened directions some tolerance. A
/// fixed step promises nothing but, at a level that leaves none, what the projection does.
double DriftShare(const Record& record);
double PromisedDriftShare(const Record& record);

/// The largest true error of points over the length of a link, where a reference told it; else NaN.
double TrueErrorShare(const Record& record);
/// The longest step in periods of the fastest drive: what has less than two looks per period may
/// take it for anything. NaN without a drive.
double PeriodsPerStep(const Record& record);

/// The codes of what an accuracy record says against itself, separated by spaces, "" for none. Of
/// runs that did not finish their outcome says enough: "".
std::string OwnDoubts(const Record& record);

/// Sets `doubts` of every accuracy record that finished, those that only runs together know among
/// them, and `agreement`: which runs of the same scene, horizon and tolerance ended alike.
void SetDoubts(std::vector<Record>* records);

/// Whether the record's doubts contain `code`, or any with "".
bool HasDoubt(const Record& record, const std::string& code = "");

// Whether finer tolerances bring a column's runs nearer to one end: what an integrator promises,
// and what a wrong derivative, a tolerance that is not heeded or a motion without an end to
// converge to do not keep.

/// Final poses nearer than this, over links and in rad, are alike for rounding's sake: below 1e-11
/// comparisons hold all errors for round-off (harness/judge/demand.h).
inline constexpr double kRoundOffShare = 1e-11;

struct Refinement {
  bool doubted = false;
  /// Largest difference of final poses from those at the column's finest tolerance, and of the run
  /// at the next coarser one; NaN where nothing was compared.
  double off = 0.0, off_before = 0.0;
};

/// One for each record, in their order. Compared are accuracy runs that finished and differ in
/// nothing but the tolerance, of three tolerances at least: distances from the finest run must
/// shrink. One that is still 1000 tolerances away (kMostTolerances) and has not shrunk by even the
/// fourth root of the tolerances' ratio puts the finer runs in doubt; so do two runs of more than a
/// dozen steps that are the same in every bit and step, for then the tolerance had no effect.
std::vector<Refinement> CompareTolerances(std::span<const Record> records);

}  // namespace loopbench::harness
