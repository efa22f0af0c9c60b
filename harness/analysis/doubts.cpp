#include "harness/analysis/doubts.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <sstream>

#include "harness/analysis/agreement.h"
#include "harness/analysis/refinement.h"
#include "harness/config/experiment.h"
#include "harness/config/formulations.h"
#include "harness/config/published_series.h"
#include "mechanism/loops/scaled_loops.h"

namespace loopbench::harness {
namespace {

/// Energy balance: a hundredth of the energy that moves is no error of integration at any tolerance
/// that deserves the name; regular runs at 1e-6 have 1e-3 and less.
constexpr double kMostEnergyError = 1e-2;
/// Rounding of an evaluation, which adds to a tolerance.
constexpr double kEvaluation = 100 * std::numeric_limits<double>::epsilon();

/// Factors of n^2 and n in the promised drift. Over 20 s at 1e-6 and 1e-9 the regular shipped
/// mechanisms stay below 0.004 and 0.03 (the crank-rocker driven at 3 rad/s has both), Bennett's
/// linkage, whose drift grows exponentially with its redundant rows kept, reached 0.1 after 20 s
/// and 0.2 to 30 after 50 s.
constexpr double kAcceleration = 0.02, kVelocity = 0.2;
/// Few steps have more room: each may err by some tolerances.
constexpr double kFewSteps = 10.0;
/// Steps that Baumgarte's default gains, 0.05/h, remember: twice one over the gain.
constexpr double kRemembered = 40.0;
/// Where steps are fixed, no tolerance promises anything of their errors: a loop that is open by a
/// tenth of a link, beyond which growth is not analysed either, is none whatever the step.
constexpr double kOpenLoop = 0.1;
/// Over the projection's goal, for what rounding does to the evaluation itself: 15 were seen.
constexpr double kProjection = 25.0;

/// Sampled less than twice a period, an oscillation looks like a slow one (Nyquist).
constexpr double kMostPeriods = 0.5;
/// A step of 16 eps t ends a run (harness/integrator/integrate.cpp). Steps within three decades of
/// that gain digits of nothing; no regular run comes within six.
constexpr double kStepFloor = 1e3 * 16 * std::numeric_limits<double>::epsilon();
/// Rejected steps for each accepted one: step control that fails more often than not follows what
/// is no smooth solution. Less than a dozen say nothing.
constexpr double kMostRejected = 1.0, kFewRejected = 12.0;

/// Step control at its floor, or failing all the time.
bool StepsStruggle(const Record& record) {
  const double rejected = record.Number("rejected");
  if (rejected > kFewRejected && rejected > kMostRejected * record.Number("steps")) return true;
  return record.Number("step_shortest") <= kStepFloor * record.Number("step_shortest_t");
}

bool HasFinished(const Record& record) { return record.Text("outcome") == "finished"; }

/// Accepted steps that Baumgarte's feedback remembers: those within 2/gain.
double StepsRemembered(const Record& record) {
  const double alpha = record.Number("alpha"), beta = record.Number("beta");
  if (std::isnan(alpha) && std::isnan(beta)) return kRemembered;
  const double gain = std::fmin(alpha, beta);
  const double per_second = record.Number("steps") / record.Number("t_reached");
  return gain > 0.0 ? 2.0 / gain * per_second : record.Number("steps");
}

/// Tolerances that drift may add up to at the record's level.
double TolerancesOfDrift(const Record& record) {
  const double steps = record.Number("steps");
  const auto growth = GrowthAt(record);
  double tolerances = kFewSteps;
  if (growth == DriftGrowth::kSquare) tolerances += kAcceleration * steps * steps;
  if (growth == DriftGrowth::kLinear) tolerances += kVelocity * steps;
  if (growth == DriftGrowth::kForgotten) {
    const double remembered = std::min(steps, StepsRemembered(record));
    tolerances += kAcceleration * remembered * remembered;
  }
  return tolerances;
}

/// What moves is a millionth of what the absolute tolerance lets pass, with masses near 1 kg: what
/// feedback makes of rounding in a mechanism at rest.
bool IsAtRest(const Record& record) {
  const double speed = 1e-6 * record.Number("atol");
  return record.Number("energy_scale") <= speed * speed;
}

/// Near enough to a singular position that the level has nothing to keep the branch by. Records of
/// large mechanisms do not know the distance, but whether evaluations were softened.
bool PassedSingularPosition(const Record& record) {
  if (GrowthAt(record) == DriftGrowth::kNone) return false;
  if (record.Number("singularity_passages") > 0) return true;
  const double distance = record.Number("singularity_distance_min");
  if (std::isnan(distance)) return record.Number("softened_evaluations") > 0;
  return distance < kRankRatio;
}

/// Regularized, which bends the motion by more than tolerances, although no position at which steps
/// ended was near a singular one.
bool WasSoftenedElsewhere(const Record& record) {
  return record.Number("softened_evaluations") > 0 && record.Number("singularity_passages") == 0 &&
         record.Number("singularity_distance_min") >= kRankRatio;
}

void Add(std::string* codes, bool on, const char* code) {
  if (on) *codes += (codes->empty() ? "" : " ") + std::string(code);
}

/// The same codes but for one.
std::string Without(const std::string& code, const std::string& codes) {
  std::istringstream words(codes);
  std::string rest;
  for (std::string word; words >> word;) Add(&rest, word != code, word.c_str());
  return rest;
}

/// Whether a run with these codes has nothing against the way that it went: members of ensembles
/// and exponents are not about it.
bool TellsOfItsWay(const std::string& codes) {
  return Without(kMembersDoubt, Without(kExponentDoubt, codes)).empty();
}

/// An error that a published series may know in place of, or besides, that of points, and the
/// series' own. Speeds have no scale that holds for all mechanisms.
struct OtherError {
  const char *error, *accuracy;
  bool is_length;
};
constexpr OtherError kOtherErrors[] = {
    {"error_angle_max", "reference_error_angle", false},
    {"error_rotation_max", "reference_error_rotation", false},
    {"error_displacement_max", "reference_error_displacement", true}};

/// Fixed steps have no tolerance: errors up to a hundredth of a link or rad are then accepted, as
/// for the energy.
constexpr double kMostFixedError = 1e-2;

/// Within as many tolerances as runs may be apart. The reference has an error of its own, and
/// rounding is no fault of a tolerance.
bool IsNear(const Record& record, const char* error, const char* accuracy, double length) {
  const double certain = record.Number(accuracy) / length + kRoundOffShare;
  const double expected =
      record.Number("step") > 0.0 ? kMostFixedError : kMostTolerances * record.Number("rtol");
  return record.Number(error) / length <= expected + certain;
}

/// Of all errors that are known.
bool IsNearReference(const Record& record) {
  const double link = record.Number("link_length");
  const auto has = [&](const char* key) { return record.Find(key) != nullptr; };
  if (has("error_position_max") && !IsNear(record, "error_position_max", "reference_error", link))
    return false;
  return std::ranges::all_of(kOtherErrors, [&](const OtherError& other) {
    return !has(other.accuracy) || !has(other.error) ||
           IsNear(record, other.error, other.accuracy, other.is_length ? link : 1.0);
  });
}

/// The same to the end of the run. A published series sees some of the motion at some times: who
/// agrees with it need not have kept the way.
bool IsCertified(const Record& record) {
  return record.Find("error_position_end") != nullptr && record.Text("reference") != kPublished &&
         IsNearReference(record);
}

/// By more than runs of one tolerance may be apart (kMostTolerances), if a finer run was asked for.
bool IsFarFromFinerRun(const Record& record) {
  const double most = kMostTolerances * record.Number("rtol") + kRoundOffShare;
  return record.Find("refinement_difference") != nullptr &&
         !(record.Number("refinement_difference") <= most);
}

}  // namespace

std::optional<DriftGrowth> GrowthAt(const Record& record) {
  const auto level = FindLevel(record.Text("enforcement"));
  if (!level) return std::nullopt;
  return TraitsOf(*level).growth;
}

double ExpectedEnergyShare(const Record& record) {
  const double rtol = record.Number("rtol");
  if (!(rtol > 0.0) || IsPeer(record)) return kMostEnergyError;
  // no level puts the energy back, so that errors of all steps add up
  const double tolerances = TolerancesOfDrift(record) + kVelocity * record.Number("steps");
  const double scale = record.Number("energy_scale");
  const double per_tolerance = std::fmax(1.0, record.Number("energy_sensitivity") / scale);
  return std::min(kMostEnergyError, tolerances * (rtol + kEvaluation) * per_tolerance);
}

double EnergyErrorShare(const Record& record) {
  if (record.Find("energy_scale") == nullptr) return record.Number("energy_error_relative");
  const double error = record.Number("energy_error_max");
  return error == 0.0 ? 0.0 : error / record.Number("energy_scale");
}

double DriftShare(const Record& record) {
  const double shift = record.Number("drift_position_max") / record.Number("link_length");
  const double rotation = record.Number("drift_rotation_max");
  if (record.Find("drift_rotation_max") == nullptr) return shift;
  return shift <= rotation || std::isnan(rotation) ? rotation : shift;
}

double PromisedDriftShare(const Record& record) {
  const double rtol = record.Number("rtol");
  const double goal = kProjection * record.Number("position_goal") / record.Number("link_length");
  const auto growth = GrowthAt(record);
  // nothing is left but of softened directions, and what peers, which project to a part of their
  // tolerance, leave
  const bool left = record.Number("softened_evaluations") > 0 || IsPeer(record);
  const bool is_fixed = record.Number("step") > 0.0;
  double promised = is_fixed ? kOpenLoop : TolerancesOfDrift(record) * rtol;
  if (growth == DriftGrowth::kNone && !left) promised = 0.0;
  return record.Find("position_goal") == nullptr ? promised : std::max(promised, goal);
}

double TrueErrorShare(const Record& record) {
  const double link = record.Number("link_length");
  double share = record.Number("error_position_max") / link;
  for (const OtherError& other : kOtherErrors) {
    if (record.Find(other.accuracy) == nullptr) continue;
    share = std::fmax(share, record.Number(other.error) / (other.is_length ? link : 1.0));
  }
  return share;
}

double PeriodsPerStep(const Record& record) {
  return record.Number("step_longest") * record.Number("drive_frequency") / (2 * std::numbers::pi);
}

std::string OwnDoubts(const Record& record) {
  std::string codes;
  if (record.Text("kind") != "accuracy" || !HasFinished(record)) return codes;
  // a measure that is no number is none to rely on; one that was not taken says nothing
  const auto has = [&](const char* key) { return record.Find(key) != nullptr; };
  Add(&codes,
      (has("energy_scale") || has("energy_error_relative")) &&
          !(EnergyErrorShare(record) <= ExpectedEnergyShare(record)) && !IsAtRest(record),
      kEnergyDoubt);
  // where the reference knows the way, who kept to it did
  Add(&codes, PassedSingularPosition(record) && !IsCertified(record), kSingularDoubt);
  Add(&codes, WasSoftenedElsewhere(record) && !IsCertified(record), kSoftenedDoubt);
  Add(&codes,
      has("drift_position_max") && has("link_length") &&
          !(DriftShare(record) <= PromisedDriftShare(record)),
      kDriftDoubt);
  Add(&codes, !IsNearReference(record), kErrorDoubt);
  Add(&codes, IsFarFromFinerRun(record) && !IsCertified(record), kRefinementDoubt);
  Add(&codes, PeriodsPerStep(record) > kMostPeriods, kDriveDoubt);
  Add(&codes, StepsStruggle(record), kStepsDoubt);
  Add(&codes, record.Number("ensemble_failed") > 0, kMembersDoubt);
  // a single run was not asked for an exponent, and drift of round-off has none
  Add(&codes,
      record.Number("ensemble_size") > 0 && record.Text("growth_resolved") == "false" &&
          record.Text("growth_regime") != "round-off",
      kExponentDoubt);
  return codes;
}

void SetDoubts(std::vector<Record>* records) {
  std::vector<std::string> own;
  std::vector<bool> testifies;
  for (const Record& record : *records) {
    own.push_back(OwnDoubts(record));
    testifies.push_back(TellsOfItsWay(own.back()));
  }
  const std::vector<Agreement> agreements = CompareFinalPoses(*records, testifies);
  const std::vector<Refinement> refinements = CompareTolerances(*records);
  for (std::size_t i = 0; i < records->size(); ++i) {
    Record& record = (*records)[i];
    if (record.Text("kind") != "accuracy" || !HasFinished(record)) continue;
    // the others need not be right; a reference is
    const bool certified = IsCertified(record);
    // who ends as those do that can keep a branch has kept it
    std::string codes = agreements[i].is_backed ? Without(kSingularDoubt, own[i]) : own[i];
    Add(&codes, agreements[i].doubted && !certified, kDisagreementDoubt);
    const bool is_known = own[i].find(kRefinementDoubt) != own[i].npos;
    Add(&codes, refinements[i].doubted && !certified && !is_known, kRefinementDoubt);
    record.Set("doubts", codes);
    if (agreements[i].cluster > 0) record.Set("agreement", agreements[i].cluster);
  }
}

bool HasDoubt(const Record& record, const std::string& code) {
  const std::string codes = record.Text("doubts");
  return code.empty() ? !codes.empty() : (" " + codes + " ").find(" " + code + " ") != codes.npos;
}

}  // namespace loopbench::harness
