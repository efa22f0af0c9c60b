// Reasons not to rely on a run although it finished: what its own record says against it, and what
// the other runs of its scene do (agreement.h).
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "harness/record/record.h"
#include "mechanism/formulation/options.h"

namespace loopbench::harness {

/// The codes of `doubts` (docs/reference/outcomes-and-warnings.md); programs may rely on them.
inline constexpr const char* kEnergyDoubt = "energy";
inline constexpr const char* kSingularDoubt = "singular-passage";
inline constexpr const char* kSoftenedDoubt = "softened";
inline constexpr const char* kDriftDoubt = "drift";
inline constexpr const char* kMembersDoubt = "members-failed";
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

}  // namespace loopbench::harness
