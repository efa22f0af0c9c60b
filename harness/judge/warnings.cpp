#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <iterator>
#include <limits>
#include <map>
#include <numbers>
#include <optional>
#include <set>
#include <sstream>
#include <string>
#include <string_view>
#include <utility>

#include "harness/base/text.h"
#include "harness/config/experiment.h"
#include "harness/config/formulations.h"
#include "harness/config/published_series.h"
#include "harness/judge/analysis.h"
#include "mechanism/loops/scaled_loops.h"

namespace loopbench::harness {
namespace {

/// Final poses nearer than this, over links and in rad, are alike for rounding's sake: below 1e-11
/// comparisons hold all errors for round-off (harness/judge/judge.h).
constexpr double kRoundOffShare = 1e-11;

constexpr std::string_view kPrefix = "series.final.";

/// Runs of one problem, horizon and tolerance with equal final poses, by index, largest set first.
using Clusters = std::vector<std::vector<std::size_t>>;

/// Returns the largest of the relative and the absolute tolerances of a run; NaN without.
double ToleranceOf(const Record& record) {
  double largest = record.Number("rtol");
  for (const char* key :
       {"atol", "atol_length", "atol_angle", "atol_speed", "atol_angular_speed"}) {
    largest = std::fmax(largest, record.Number(key));
  }
  return largest;
}

bool IsFinishedRun(const Record& record) {
  return record.Text("kind") == "accuracy" && record.Text("outcome") == "finished";
}

bool HasFinalPoses(const Record& record) {
  return IsFinishedRun(record) && !record.Text("problem_id").empty() &&
         !std::isnan(record.Number("rtol")) &&
         std::ranges::any_of(record.items(),
                             [](const auto& item) { return item.first.starts_with(kPrefix); });
}

const std::vector<double>* PoseOf(const std::string& key, const Value& value) {
  return key.starts_with(kPrefix) ? std::get_if<std::vector<double>>(&value) : nullptr;
}

/// Returns the unit of component i of a pose: link length, or 1 rad.
double UnitOf(double link_length, std::size_t size, std::size_t i) {
  return i < (size == 3 ? 2u : 3u) ? link_length : 1.0;
}

bool IsSoft(const Record& record) {
  const FormulationRow* row = FindFormulation(record.Text("formulation"));
  return row != nullptr && row->is_soft;
}

/// Returns the runs for which `chooses` is true.
template <class Choose>
std::vector<std::size_t> Only(std::vector<std::size_t> runs, const Choose& chooses) {
  std::erase_if(runs, std::not_fn(chooses));
  return runs;
}

bool EndAlike(const Record& a, const Record& b, double rtol) {
  return DifferenceOf(a, b).largest <= kMaxTolerances * rtol;
}

/// Final poses of a set of runs: of each component the least and the largest. A number that is not
/// finite, or is not there, is as far as can be from all others.
class Bounds {
 public:
  /// Returns true if `run` has the final pose of each run in the cluster.
  bool Fit(const Record& run, double rtol) const {
    for (const auto& [key, value] : run.items()) {
      const auto* pose = PoseOf(key, value);
      if (pose == nullptr) continue;
      const auto known = bounds_.find(key);
      if (known == bounds_.end()) continue;  // simplified away there
      const auto& [low, high] = known->second;
      if (low.size() != pose->size()) return false;
      for (std::size_t i = 0; i < pose->size(); ++i) {
        const double off = std::max((*pose)[i] - low[i], high[i] - (*pose)[i]);
        if (!(off / UnitOf(length_, pose->size(), i) <= kMaxTolerances * rtol)) return false;
      }
    }
    return true;
  }
  void Take(const Record& run) {
    if (length_ == 0.0) length_ = run.Number("link_length");
    for (const auto& [key, value] : run.items()) {
      const auto* pose = PoseOf(key, value);
      if (pose == nullptr || pose->empty()) continue;
      auto& [low, high] = bounds_.try_emplace(key, *pose, *pose).first->second;
      if (low.size() != pose->size()) low[0] = -kFar, high[0] = kFar;
      for (std::size_t i = 0; i < std::min(low.size(), pose->size()); ++i) {
        const double number = (*pose)[i];
        low[i] = std::isfinite(number) ? std::min(low[i], number) : -kFar;
        high[i] = std::isfinite(number) ? std::max(high[i], number) : kFar;
      }
    }
  }
  PoseDifference Widest() const {
    PoseDifference widest;
    for (const auto& [key, bounds] : bounds_) {
      const auto& [low, high] = bounds;
      for (std::size_t i = 0; i < low.size(); ++i) {
        double off = (high[i] - low[i]) / UnitOf(length_, low.size(), i);
        if (std::isnan(off)) off = kFar;
        if (off > widest.largest) widest = {off, key.substr(kPrefix.size())};
      }
    }
    return widest;
  }

 private:
  static constexpr double kFar = std::numeric_limits<double>::infinity();
  std::map<std::string, std::pair<std::vector<double>, std::vector<double>>> bounds_;
  double length_ = 0.0;
};

Clusters ClustersOf(std::span<const Record> records, const std::vector<std::size_t>& runs,
                    double rtol) {
  Clusters clusters;
  std::vector<Bounds> bounds;
  for (const std::size_t run : runs) {
    const auto place = std::ranges::find_if(
        bounds, [&](const Bounds& cluster) { return cluster.Fit(records[run], rtol); });
    const auto index = static_cast<std::size_t>(place - bounds.begin());
    if (place == bounds.end()) {
      clusters.emplace_back();
      bounds.emplace_back();
    }
    clusters[index].push_back(run);
    bounds[index].Take(records[run]);
  }
  std::ranges::stable_sort(clusters, std::greater<>(), &std::vector<std::size_t>::size);
  return clusters;
}

/// Returns true if runs of different equations are all in one cluster.
bool Decides(std::span<const Record> records, const Clusters& clusters) {
  if (clusters.size() != 1) return false;
  std::set<std::string> ways;
  for (const std::size_t run : clusters.front()) {
    ways.insert(records[run].Text("enforcement") + " " + records[run].Text("coordinates"));
  }
  return ways.size() > 1;
}

/// Returns true if the run's level restores the branch at every step.
bool KeepsBranches(const Record& record) {
  const auto level = FindLevel(record.Text("enforcement"));
  return level && TraitsOf(*level).growth == DriftGrowth::kNone && !IsPeer(record);
}

/// Returns a run whose final pose decides for its tolerance: all runs of its integrator (and the
/// external engines) agree. Null if none or if another integrator's runs agree elsewhere.
const Record* DecidedBy(std::span<const Record> records, const std::vector<std::size_t>& runs,
                        double rtol) {
  std::set<std::string> integrators;
  for (const std::size_t run : runs) {
    if (!IsPeer(records[run])) integrators.insert(records[run].Text("integrator"));
  }
  const Record* decided = nullptr;
  for (const std::string& integrator : integrators) {
    const std::vector<std::size_t> own = Only(runs, [&](std::size_t run) {
      return IsPeer(records[run]) || records[run].Text("integrator") == integrator;
    });
    if (!Decides(records, ClustersOf(records, own, rtol))) continue;
    const Record* witness = &records[own.front()];
    if (decided != nullptr && !EndAlike(*decided, *witness, rtol)) return nullptr;
    if (decided == nullptr) decided = witness;
  }
  return decided;
}

}  // namespace

bool IsPeer(const Record& record) {
  const FormulationRow* row = FindFormulation(record.Text("formulation"));
  return row != nullptr && row->is_peer();
}

PoseDifference LargestDifference(std::span<const Record> runs) {
  Bounds bounds;
  for (const Record& run : runs) bounds.Take(run);
  return bounds.Widest();
}

PoseDifference DifferenceOf(const Record& a, const Record& b) {
  Bounds bounds;
  for (const Record* run : {&a, &b}) bounds.Take(*run);
  return bounds.Widest();
}

std::vector<Agreement> CompareFinalPoses(std::span<const Record> records,
                                         std::vector<bool> testifies) {
  if (testifies.empty()) testifies.assign(records.size(), true);
  // by problem and horizon, then by tolerance, the finest first
  std::map<std::pair<std::string, double>, std::map<double, std::vector<std::size_t>>> problems;
  for (std::size_t i = 0; i < records.size(); ++i) {
    if (!HasFinalPoses(records[i])) continue;
    problems[{records[i].Text("problem_id"), records[i].Number("horizon")}][ToleranceOf(records[i])]
        .push_back(i);
  }
  std::vector<Agreement> agreements(records.size());
  for (const auto& [problem, tolerances] : problems) {
    const Record* decided = nullptr;
    for (const auto& [rtol, all] : tolerances) {
      const auto runs = Only(all, [&](std::size_t run) { return !IsSoft(records[run]); });
      auto witnesses = Only(runs, [&](std::size_t run) { return testifies[run]; });
      if (witnesses.empty()) witnesses = runs;
      const Clusters clusters = ClustersOf(records, runs, rtol);
      if (decided == nullptr) decided = DecidedBy(records, witnesses, rtol);
      const Record* others = decided;  // those that do not give way, where they agree
      if (others == nullptr && clusters.size() == 1) others = &records[clusters.front().front()];
      for (std::size_t c = 0; c < clusters.size(); ++c) {
        for (const std::size_t run : clusters[c]) {
          if (all.size() > 1) agreements[run].cluster = static_cast<std::int64_t>(c) + 1;
        }
      }
      for (const std::size_t run : all) {
        if (runs.empty()) continue;
        Agreement& agreement = agreements[run];
        agreement.flagged = others == nullptr || !EndAlike(records[run], *others, rtol);
        if (!IsSoft(records[run])) continue;
        agreement.cluster = agreement.flagged ? static_cast<std::int64_t>(clusters.size()) + 1 : 1;
      }
      // a branch is kept by who ends as those do that can keep it
      const bool is_kept = std::ranges::any_of(witnesses, [&](std::size_t run) {
        return testifies[run] && KeepsBranches(records[run]) && !agreements[run].flagged;
      });
      for (const std::size_t run : runs) {
        agreements[run].is_backed = is_kept && !agreements[run].flagged;
      }
    }
  }
  return agreements;
}

namespace {

/// Energy balance: a hundredth of the energy that moves is no error of integration at any tolerance
/// that deserves the name; regular runs at 1e-6 have 1e-3 and less.
constexpr double kMaxEnergyError = 1e-2;
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
/// With fixed steps no tolerance bounds the errors. A loop-closure error of a tenth of a link
/// counts as open for any step size; growth is not analysed beyond it either.
constexpr double kOpenLoop = 0.1;
/// Factor over the projection's tolerance for rounding in the evaluation; 15 was observed.
constexpr double kProjection = 25.0;

/// Sampled less than twice a period, an oscillation looks like a slow one (Nyquist).
constexpr double kMaxPeriods = 0.5;
/// A step of 16 eps t ends a run (harness/integrator/stepper.cpp). Steps within three decades of
/// that gain digits of nothing; no regular run comes within six.
constexpr double kStepFloor = 1e3 * 16 * std::numeric_limits<double>::epsilon();
/// Maximum of rejected steps per accepted step: if step control fails more often, the solution is
/// not smooth. Fewer than a dozen rejections are not significant.
constexpr double kMaxRejected = 1.0, kFewRejected = 12.0;

/// Step control at its floor, or failing all the time.
bool StepControlFailing(const Record& record) {
  const double rejected = record.Number("rejected");
  if (rejected > kFewRejected && rejected > kMaxRejected * record.Number("steps")) return true;
  return record.Number("step_shortest") <= kStepFloor * record.Number("step_shortest_t");
}

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

/// Returns true if the energy corresponds to speeds below 1e-6 of the absolute tolerance at 1 kg
/// (round-off amplified by Baumgarte feedback).
bool IsAtRest(const Record& record) {
  const char* key = record.Find("atol_speed") != nullptr ? "atol_speed" : "atol";
  const double speed = 1e-6 * record.Number(key);
  return record.Number("energy_scale") <= speed * speed;
}

/// The distance from a singular configuration within which drift may have changed the branch. Loops
/// that are open by e miss a singular configuration by about sqrt(2 e / L), with links of length L.
/// At most the distance of mechanisms that are called nearly singular.
double DistanceOfBranches(const Record& record) {
  const double open = record.Number("drift_position_max") / record.Number("link_length");
  const double missed = 2.0 * std::sqrt(open);
  return missed > kRankRatio ? std::min(missed, kNearSingularRatio) : kRankRatio;
}

/// Returns true if the run came too near a singular configuration for its level to keep the branch.
/// Records of large mechanisms lack the distance, but count regularized evaluations.
bool PassedSingularPosition(const Record& record) {
  if (GrowthAt(record) == DriftGrowth::kNone) return false;
  if (record.Number("singularity_crossings") > 0) return true;
  const double distance = record.Number("singularity_distance_min");
  if (std::isnan(distance)) return record.Number("regularized_evaluations") > 0;
  return distance < DistanceOfBranches(record);
}

/// Regularized, which bends the motion by more than tolerances, although no position at which steps
/// ended was near a singular one.
bool WasRegularizedElsewhere(const Record& record) {
  return record.Number("regularized_evaluations") > 0 &&
         record.Number("singularity_crossings") == 0 &&
         record.Number("singularity_distance_min") >= kRankRatio;
}

/// Error measure of published data besides or instead of the error of points. Speeds are left out:
/// they have no scale that holds for all mechanisms.
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
constexpr double kMaxFixedError = 1e-2;

/// Within as many tolerances as runs may be apart. The reference has an error of its own, and
/// rounding is no fault of a tolerance.
bool IsNear(const Record& record, const char* error, const char* accuracy, double length) {
  const double certain = record.Number(accuracy) / length + kRoundOffShare;
  const double expected =
      record.Number("step") > 0.0 ? kMaxFixedError : kMaxTolerances * ToleranceOf(record);
  return record.Number(error) / length <= expected + certain;
}

/// Returns true if all known errors are small.
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

/// Returns true for agreement to the end of the run. Published data are sparse, so agreement with
/// them does not prove the branch.
bool IsCertified(const Record& record) {
  return record.Find("error_position_end") != nullptr && record.Text("reference") != kPublished &&
         IsNearReference(record);
}

/// Returns true if the finer run of the case differs by more than kMaxTolerances, or with fixed
/// steps by more than kMaxFixedError.
bool IsFarFromFinerRun(const Record& record) {
  const double most = record.Number("step") > 0.0
                          ? kMaxFixedError
                          : kMaxTolerances * ToleranceOf(record) + kRoundOffShare;
  return record.Find("refinement_difference") != nullptr &&
         !(record.Number("refinement_difference") <= most);
}

/// Returns the expected share of the energy balance error, from tolerance and steps.
double ExpectedEnergyShare(const Record& record) {
  const double tolerance = ToleranceOf(record);
  if (!(tolerance > 0.0) || IsPeer(record)) return kMaxEnergyError;
  // no level puts the energy back, so that errors of all steps add up
  const double tolerances = TolerancesOfDrift(record) + kVelocity * record.Number("steps");
  const double scale = record.Number("energy_scale");
  const double per_tolerance = std::fmax(1.0, record.Number("energy_sensitivity") / scale);
  return std::min(kMaxEnergyError, tolerances * (tolerance + kEvaluation) * per_tolerance);
}

/// Returns the largest energy balance error over the exchanged energy (`energy_scale`; in records
/// without it the largest kinetic energy). NaN if not measured.
double EnergyErrorShare(const Record& record) {
  if (record.Find("energy_scale") == nullptr) return record.Number("energy_error_relative");
  const double error = record.Number("energy_error_max");
  return error == 0.0 ? 0.0 : error / record.Number("energy_scale");
}

/// Returns the drift of a run over a link length, or in rad if rotations drift further. NaN if not
/// measured.
double DriftShare(const Record& record) {
  const double shift = record.Number("drift_position_max") / record.Number("link_length");
  const double rotation = record.Number("drift_rotation_max");
  if (record.Find("drift_rotation_max") == nullptr) return shift;
  return shift <= rotation || std::isnan(rotation) ? rotation : shift;
}

/// Returns the drift expected at the record's level (docs/theory/constraints-and-drift.md).
///
/// A step of tolerance rtol leaves errors of about rtol in positions and speeds. At velocity level
/// position errors add up to n rtol. At acceleration level speed errors persist: n^2 rtol times the
/// angle per step. Baumgarte feedback damps all but the last steps; projection leaves round-off,
/// and some tolerance in regularized directions. Fixed steps have no expected drift except with
/// projection.
double ExpectedDriftShare(const Record& record) {
  const double tolerance = ToleranceOf(record);
  const double goal = kProjection * record.Number("position_goal") / record.Number("link_length");
  const auto growth = GrowthAt(record);
  // the rest is due to regularized directions, or to external engines, which project to a fraction
  // of their tolerance
  const bool left = record.Number("regularized_evaluations") > 0 || IsPeer(record);
  const bool is_fixed = record.Number("step") > 0.0;
  double promised = is_fixed ? kOpenLoop : TolerancesOfDrift(record) * tolerance;
  if (growth == DriftGrowth::kNone && !left) promised = 0.0;
  return record.Find("position_goal") == nullptr ? promised : std::max(promised, goal);
}

/// Returns the largest global error of points over the link length; NaN without a reference.
double TrueErrorShare(const Record& record) {
  const double link = record.Number("link_length");
  double share = record.Number("error_position_max") / link;
  for (const OtherError& other : kOtherErrors) {
    if (record.Find(other.accuracy) == nullptr) continue;
    share = std::fmax(share, record.Number(other.error) / (other.is_length ? link : 1.0));
  }
  return share;
}

/// Returns the longest step in periods of the fastest driver; NaN without a driver. Fewer than two
/// samples per period cause aliasing.
double PeriodsPerStep(const Record& record) {
  return record.Number("step_longest") * record.Number("drive_frequency") / (2 * std::numbers::pi);
}

/// Returns true if the record has the key; NaN or infinite measures give a warning, missing ones
/// give none.
bool Has(const Record& record, const char* key) { return record.Find(key) != nullptr; }

const WarningRow kWarnings[] = {
    {kEnergyWarning,
     "error of the energy balance above 1 % of the exchanged energy, or larger than steps and "
     "tolerance explain",
     [](const Record& record) {
       return (Has(record, "energy_scale") || Has(record, "energy_error_relative")) &&
              !(EnergyErrorShare(record) <= ExpectedEnergyShare(record)) && !IsAtRest(record);
     },
     [](const Record& record) {
       return fmt::format("{:.2g} %, at most {:.2g} % expected", 100 * EnergyErrorShare(record),
                          100 * ExpectedEnergyShare(record));
     }},
    {kSingularWarning,
     "crosses singular configurations, where this level does not determine the branch",
     // agreement with the reference proves that the branch was kept
     [](const Record& record) { return PassedSingularPosition(record) && !IsCertified(record); },
     [](const Record& record) {
       return fmt::format("distance {:.1g} at {:.4g} s", record.Number("singularity_distance_min"),
                          record.Number("singularity_distance_min_t"));
     }},
    {kRegularizedWarning, "constraints were regularized away from singular configurations",
     [](const Record& record) { return WasRegularizedElsewhere(record) && !IsCertified(record); },
     [](const Record& record) {
       return fmt::format("{} of {} evaluations, distance {:.1g}",
                          record.Text("regularized_evaluations"), record.Text("rhs_evaluations"),
                          record.Number("singularity_distance_min"));
     }},
    {kDriftWarning, "drift is larger than steps and tolerance explain at this level",
     [](const Record& record) {
       return Has(record, "drift_position_max") && Has(record, "link_length") &&
              !(DriftShare(record) <= ExpectedDriftShare(record));
     },
     [](const Record& record) {
       return fmt::format("{:.1e} of a link or rad, at most {:.1e} expected", DriftShare(record),
                          ExpectedDriftShare(record));
     }},
    {kErrorWarning,
     "distance from the reference above 1000 tolerances, or with fixed steps above 1 % of a link",
     [](const Record& record) { return !IsNearReference(record); },
     [](const Record& record) {
       const bool only_points = record.Text("reference") != kPublished;
       return fmt::format("{:.1e} of a link{}", TrueErrorShare(record),
                          only_points ? "" : " or rad");
     }},
    {kRefinementWarning, "finer tolerances do not converge to one final state",
     [](const Record& record) { return IsFarFromFinerRun(record) && !IsCertified(record); },
     [](const Record& record) {
       if (!Has(record, "refinement_difference")) {
         return fmt::format("{} steps, state {}", record.Text("steps"), record.Text("state_hash"));
       }
       return fmt::format(
           "{:.1e} of a link or rad from the run at {}", record.Number("refinement_difference"),
           record.Number("step") > 0.0 ? "half its step" : "a tenth of its tolerance");
     }},
    {kDriveWarning, "steps longer than half a period of the fastest drive",
     [](const Record& record) { return PeriodsPerStep(record) > kMaxPeriods; },
     [](const Record& record) {
       return fmt::format("{:.2g} periods a step", PeriodsPerStep(record));
     }},
    {kStepsWarning, "step control at its shortest step, or more than half of the steps rejected",
     StepControlFailing,
     [](const Record& record) {
       return fmt::format("{} rejected of {}, shortest {:.1e} s", record.Text("rejected"),
                          record.Number("steps") + record.Number("rejected"),
                          record.Number("step_shortest"));
     }},
    {kMembersWarning, "members of the ensemble failed",
     [](const Record& record) { return record.Number("ensemble_failed") > 0; },
     [](const Record& record) {
       return record.Text("ensemble_failed") + " of " + record.Text("ensemble_size");
     }},
    {kExponentWarning, "the ensemble does not resolve the requested exponent",
     // a single run was not asked for an exponent, and drift of round-off has none
     [](const Record& record) {
       return record.Number("ensemble_size") > 0 && record.Text("growth_resolved") == "false" &&
              record.Text("growth_regime") != "round-off";
     },
     [](const Record& record) {
       return fmt::format("{:.2f} +- {:.2g}", record.Number("growth_exponent"),
                          record.Number("growth_spread"));
     }},
};

std::vector<std::string> OwnCodes(const Record& record) {
  std::vector<std::string> codes;
  for (const WarningRow& row : kWarnings) {
    if (IsFinishedRun(record) && row.is_raised(record)) codes.emplace_back(row.code);
  }
  return codes;
}

}  // namespace

std::span<const WarningRow> WarningRows() { return kWarnings; }

std::optional<DriftGrowth> GrowthAt(const Record& record) {
  const auto level = FindLevel(record.Text("enforcement"));
  if (!level) return std::nullopt;
  return TraitsOf(*level).growth;
}

std::string OwnWarnings(const Record& record) { return Joined(OwnCodes(record), " "); }

// Tests whether finer tolerances bring a method's runs nearer to one final pose. Convergence fails
// for a wrong derivative, an ignored tolerance, or a motion without a limit.

namespace {

/// Returns all keys that name the case of a run, except its tolerance.
std::string ColumnOf(const Record& record) {
  std::string name = record.Text("problem_id");
  for (const auto& [key, value] : record.items()) {
    if (key == "case_id" || key == "problem_id") break;
    if (key != "rtol" && !key.starts_with("atol")) name += "|" + key + "=" + record.Text(key);
  }
  return name;
}

/// ode45 makes ten steps of whatever is smooth: at any tolerance the same.
constexpr double kTrivialSteps = 12.0;

bool SameInEveryBit(const Record& a, const Record& b) {
  return a.Number("steps") > kTrivialSteps && a.Number("steps") == b.Number("steps") &&
         a.Number("rejected") == b.Number("rejected") && !a.Text("state_hash").empty() &&
         a.Text("state_hash") == b.Text("state_hash");
}

/// Returns which records are flagged. Compares finished accuracy runs that differ only in the
/// tolerance, for at least three tolerances: distances from the finest run must shrink. If a
/// distance exceeds 1000 tolerances (kMaxTolerances) and has not shrunk by the fourth root of the
/// tolerances' ratio, the finer runs are flagged. So are two runs of more than a dozen steps that
/// are equal in every bit and step: the tolerance had no effect.
std::vector<bool> FlaggedByTolerances(std::span<const Record> records) {
  std::map<std::string, std::vector<std::size_t>> columns;
  for (std::size_t i = 0; i < records.size(); ++i) {
    const Record& record = records[i];
    const bool counts =
        IsFinishedRun(record) && !record.Text("problem_id").empty() && ToleranceOf(record) > 0.0;
    if (counts) columns[ColumnOf(record)].push_back(i);
  }
  std::vector<bool> flagged(records.size(), false);
  for (auto& [name, runs] : columns) {
    const auto tolerance = [&](std::size_t run) { return ToleranceOf(records[run]); };
    std::ranges::stable_sort(runs, std::greater<>(), tolerance);
    const auto same = std::ranges::unique(runs, {}, tolerance);
    runs.erase(same.begin(), same.end());
    constexpr std::size_t kFewest = 3;
    if (runs.size() < kFewest) continue;
    const auto flag_from = [&](std::size_t first) {
      for (std::size_t i = first; i < runs.size(); ++i) flagged[runs[i]] = true;
    };
    double off_before = 0.0;  // at the next coarser tolerance
    for (std::size_t i = 0; i + 1 < runs.size(); ++i) {
      const double off = DifferenceOf(records[runs[i]], records[runs.back()]).largest;
      const double before = std::exchange(off_before, off);
      if (SameInEveryBit(records[runs[i]], records[runs[i + 1]])) flag_from(i);
      if (i == 0) continue;
      const double shrunk = std::pow(tolerance(runs[i]) / tolerance(runs[i - 1]), 0.25);
      const bool far = off > kMaxTolerances * tolerance(runs[i]) && off > kRoundOffShare;
      if (far && off > shrunk * before) flag_from(i);
    }
  }
  return flagged;
}

}  // namespace

void SetWarnings(std::vector<Record>* records) {
  std::vector<std::vector<std::string>> own;
  std::vector<bool> testifies;
  for (const Record& record : *records) {
    own.push_back(OwnCodes(record));
    // warnings on ensemble members and exponents do not concern the trajectory itself
    testifies.push_back(std::ranges::all_of(own.back(), [](const std::string& code) {
      return code == kMembersWarning || code == kExponentWarning;
    }));
  }
  const std::vector<Agreement> agreements = CompareFinalPoses(*records, testifies);
  const std::vector<bool> unconverged = FlaggedByTolerances(*records);
  for (std::size_t i = 0; i < records->size(); ++i) {
    Record& record = (*records)[i];
    if (!IsFinishedRun(record)) continue;
    std::vector<std::string>& codes = own[i];
    // the others need not be right; a reference is
    const bool certified = IsCertified(record);
    // who ends as those do that can keep a branch has kept it
    if (agreements[i].is_backed) std::erase(codes, kSingularWarning);
    if (agreements[i].flagged && !certified) codes.emplace_back(kDisagreementWarning);
    if (unconverged[i] && !certified) AddOnce(codes, kRefinementWarning);
    record.Set("warnings", Joined(codes, " "));
    if (agreements[i].cluster > 0) record.Set("agreement", agreements[i].cluster);
  }
}

std::vector<std::string> WarningsOf(const Record& record) {
  std::istringstream codes(record.Text("warnings"));
  return {std::istream_iterator<std::string>(codes), {}};
}

bool HasWarning(const Record& record, const std::string& code) {
  return code.empty() ? !record.Text("warnings").empty() : Contains(WarningsOf(record), code);
}

}  // namespace loopbench::harness
