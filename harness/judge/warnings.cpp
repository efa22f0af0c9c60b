// Warnings about runs and about models.
#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <numbers>
#include <optional>
#include <sstream>
#include <string>
#include <vector>

#include "harness/base/text.h"
#include "harness/config/experiment.h"
#include "harness/config/formulations.h"
#include "harness/config/published_series.h"
#include "harness/judge/analysis.h"
#include "harness/judge/tables.h"
#include "mechanism/loops/excursion.h"
#include "mechanism/loops/scaled_loops.h"
#include "mechanism/model/force_elements.h"
#include "mechanism/model/kinematics.h"
#include "mechanism/start/poses.h"

namespace loopbench::harness {

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

bool IsPeer(const Record& record) {
  const FormulationRow* row = FindFormulation(record.Text("formulation"));
  return row != nullptr && row->is_peer();
}

namespace {

/// Largest error of the energy balance at any tolerance; regular runs at 1e-6 have 1e-3 and less.
constexpr double kMaxEnergyError = 1e-2;
/// Rounding of an evaluation, which adds to a tolerance.
constexpr double kEvaluation = 100 * std::numeric_limits<double>::epsilon();

/// Factors of n^2 and n in the promised drift. Regular shipped mechanisms stay below 0.004 and 0.03
/// over 20 s; Bennett's linkage with its redundant rows kept reached 0.1, and 0.2 to 30 after 50 s.
constexpr double kAcceleration = 0.02, kVelocity = 0.2;
/// Few steps have more room: each may err by some tolerances.
constexpr double kFewSteps = 10.0;
/// Steps that Baumgarte's default gains, 0.05/h, remember: twice one over the gain.
constexpr double kRemembered = 40.0;
/// A loop-closure error of a tenth of a link counts as open for any fixed step.
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

}  // namespace

bool IsCertified(const Record& record) {
  return record.Find("error_position_end") != nullptr && record.Text("reference") != kPublished &&
         IsNearReference(record);
}

namespace {

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

/// Returns the drift expected at the record's level (docs/theory/constraints-and-drift.md): after n
/// steps n rtol at velocity level, n^2 rtol times the angle per step at acceleration level.
/// Baumgarte feedback damps all but the last steps; projection leaves round-off, and some tolerance
/// in regularized directions. Fixed steps have no expected drift except with projection.
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
    {kSpringWarning,
     "a spring passes zero length, where its force has no direction and is not zero",
     [](const Record& record) {
       return record.Number("spring_reversals") > 0 && !IsCertified(record);
     },
     [](const Record& record) {
       return fmt::format("{} at {:.4g} s", record.Text("spring_reversal"),
                          record.Number("spring_reversal_t"));
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

}  // namespace

std::span<const WarningRow> WarningRows() { return kWarnings; }

std::vector<std::string> OwnCodes(const Record& record) {
  std::vector<std::string> codes;
  for (const WarningRow& row : kWarnings) {
    if (IsFinishedRun(record) && row.is_raised(record)) codes.emplace_back(row.code);
  }
  return codes;
}

std::optional<DriftGrowth> GrowthAt(const Record& record) {
  const auto level = FindLevel(record.Text("enforcement"));
  if (!level) return std::nullopt;
  return TraitsOf(*level).growth;
}

std::string OwnWarnings(const Record& record) { return Joined(OwnCodes(record), " "); }

std::vector<std::string> WarningsOf(const Record& record) {
  std::istringstream codes(record.Text("warnings"));
  return {std::istream_iterator<std::string>(codes), {}};
}

bool HasWarning(const Record& record, const std::string& code) {
  return code.empty() ? !record.Text("warnings").empty() : Contains(WarningsOf(record), code);
}

// Models.

double LinkLength(const MechanismDescription& description) {
  std::vector<Eigen::AlignedBox3d> joints(description.bodies.size());
  double link = 0.0, arm = 0.0;
  for (const JointDescription& joint : description.joints) {
    if (joint.type == JointType::kRod) link = std::max(link, joint.parameter);
    if (joint.type == JointType::kFree) continue;
    for (const JointSide& side : {joint.from, joint.to}) {
      if (side.body == kGround) continue;
      const auto body = static_cast<std::size_t>(side.body);
      joints[body].extend(side.position);
      arm = std::max(arm, (side.position - description.bodies[body].com).norm());
    }
  }
  for (const Eigen::AlignedBox3d& extent : joints) {
    if (!extent.isEmpty()) link = std::max(link, extent.diagonal().norm());
  }
  if (link > 0.0) return link;
  return arm > 0.0 ? arm : 1.0;
}

namespace {

/// The heaviest body over the lightest: beyond it half the digits of a double are the light body's.
constexpr double kLargestMassRatio = 1e8;
/// Distance of a centre of mass from the middle of its joints over the mechanism's length. Poses
/// refer to centres of mass, so joint positions have rounding errors eps times as large. Beyond
/// this limit a tolerance of 1e-12 cannot be met.
constexpr double kFarthestCentre = 1e3;

/// Returns the first six names, and the number of others.
std::string Shortened(const std::vector<std::string>& names) {
  return FirstOf(names, 6, ", ", " and {} more");
}

void AddRankWarnings(const MechanismDescription& description, const Structure& structure,
                     std::vector<std::string>* warnings) {
  if (!structure.analysed) {
    warnings->push_back(fmt::format(
        "rank is not analysed: sparse pivots leave it uncertain, and {} speeds are more than {}",
        structure.joint_u, kMaxAnalysedSpeeds));
    return;
  }
  if (structure.rounding > 0.0) {
    std::vector<std::string> joints;
    for (const RedundantDirection& redundant : structure.redundant) {
      if (redundant.coupling < 0)
        AddOnce(joints, '"' + description.joints[redundant.joint].name + '"');
    }
    warnings->push_back(fmt::format(
        "{} constraints of {} differ from dependent ones by {:.2g} rad or lengths, about the "
        "accuracy {:g} of the input: runs remove them",
        std::ranges::count(structure.redundant, -1, &RedundantDirection::coupling),
        Joined(joints, ", "), structure.rounding, description.accuracy));
  }
  for (const RedundantDirection& redundant : structure.redundant) {
    if (redundant.coupling < 0) continue;
    warnings->push_back(
        fmt::format("{} follows from other constraints, and runs do not analyse it: below level "
                    "projection they may be wrong after singular configurations",
                    redundant.name));
  }
  const bool driven = std::ranges::any_of(
      description.joints, [](const JointDescription& joint) { return !joint.motions.empty(); });
  const bool locked = structure.locked() && structure.bodies > 0 && !driven;
  if (locked && structure.freedom_at_start() > 0) {
    warnings->push_back(structure.start.message);
  } else if (locked) {
    const std::string joints = Joined(structure.loops, ", ", [&](const LoopPath& loop) {
      return description.joints[loop.cut_joint].name;
    });
    warnings->push_back(fmt::format("{} is locked: its joints{} leave no motion at the start",
                                    description.name,
                                    joints.empty() ? "" : " and the loops closed by " + joints));
  } else if (structure.singular_start()) {
    warnings->push_back(
        fmt::format("the start is a singular configuration: rank {} at the start, {} nearby",
                    structure.rank, structure.rank_nearby));
    if (structure.unmet_acceleration > 0.0) {
      warnings->push_back(fmt::format(
          "the speeds at the singular start belong to no motion: constraints miss {:.3g} m/s^2 "
          "or rad/s^2 of acceleration; give the speeds of one branch",
          structure.unmet_acceleration));
    }
  } else if (structure.conditioning() < kNearSingularRatio) {
    warnings->push_back(fmt::format(
        "the loops are nearly dependent at the start (bodies almost in line): smallest scaled "
        "singular value {:.3g} of the largest",
        structure.conditioning()));
  }
}

}  // namespace

std::vector<std::string> FindUnitWarnings(const MechanismDescription& description) {
  std::vector<std::string> large;  // "OA = 45 rad"
  double first = 0.0;
  const auto add = [&](const std::string& name, double angle) {
    if (std::abs(angle) <= 2 * std::numbers::pi) return;
    if (large.empty()) first = angle;
    large.push_back(fmt::format("{} = {:g} rad", name, angle));
  };
  const auto is_angle = [&](int joint, std::size_t coordinate) {
    const auto words = ValueWords(description.joints[joint].type, description.space, false);
    return coordinate < words.size() && words[coordinate].unit == "rad";
  };
  for (const JointValues& given : description.initial.coordinates) {
    for (std::size_t i = 0; i < given.values.size(); ++i) {
      if (is_angle(given.joint, i)) add(description.joints[given.joint].name, given.values[i]);
    }
  }
  for (const JointDescription& joint : description.joints) {
    add("rotation of " + joint.name, joint.from.rotation.norm());
    add("rotation of " + joint.name, joint.to.rotation.norm());
  }
  for (ForceDescription force : description.forces) {
    const ForceParts parts = PartsOf(force);
    for (const ForceNumber& number : parts.numbers) {
      if (number.quantity != quantity::kCoordinate || !is_angle(*parts.joint, 0)) continue;
      add(fmt::format("{} of the {} in {}", number.key, parts.name,
                      description.joints[*parts.joint].name),
          *number.value);
    }
  }
  if (large.empty()) return {};
  return {
      fmt::format("more than a turn: {}; angles are in rad, and {:g} degrees would be {:.6g} rad",
                  Shortened(large), first, first * std::numbers::pi / 180)};
}

std::vector<std::string> FindGuessWarnings(const MechanismDescription& description,
                                           const VectorX<double>& q) {
  std::vector<std::string> warnings;
  for (const MissedGuess& guess : FindMissedGuesses(description, q)) {
    const JointDescription& joint = description.joints[guess.joint];
    std::string& text =
        warnings.emplace_back(fmt::format("the guess of joint \"{}\" is missed: ", joint.name));
    if (guess.coordinate < 0) {
      text += fmt::format("its orientation starts {:.4g} rad away", guess.by);
    } else {
      const auto words = ValueWords(joint.type, description.space, false);
      const ValueWord& word = words[static_cast<std::size_t>(guess.coordinate)];
      text += fmt::format("its {} starts at {:.6g} {}, guessed {:.6g} {}", word.name,
                          guess.guess + guess.by, word.unit, guess.guess, word.unit);
    }
  }
  for (const auto& [target, shift, turn] : FindMissedPoses(description, q)) {
    std::string& text = warnings.emplace_back(
        fmt::format("the target of body \"{}\" is missed:", description.bodies[target->body].name));
    if (target->at) text += fmt::format(" its point starts {:.4g} m away", shift);
    if (target->at && target->rotation) text += ",";
    if (target->rotation) text += fmt::format(" its axes start {:.4g} rad away", turn);
  }
  return warnings;
}

std::vector<std::string> FindForceWarnings(const MechanismDescription& description,
                                           const VectorX<double>& q) {
  const auto is_spring = [](const ForceDescription& force) {
    return std::holds_alternative<SpringDamper>(force);
  };
  if (std::ranges::none_of(description.forces, is_spring)) return {};
  return ForSpace(description.space, [&]<class Space>(Space) {
    const Mechanism<Space, double> mechanism(description, Coordinates::kJoint);
    Kinematics<Space, double> kinematics(mechanism);
    kinematics.UpdatePosition(q);
    const auto at = [&](const BodyPoint& point) {
      const PointOfBody<Space, double> material(point, description);
      const Pose<Space, double>& X_WB = kinematics.poses()[material.body];
      return Linear<Space, double>(X_WB.p + X_WB.R * material.at);
    };
    std::vector<std::string> warnings;
    for (std::size_t i = 0; i < description.forces.size(); ++i) {
      const auto* spring = std::get_if<SpringDamper>(&description.forces[i]);
      if (spring == nullptr) continue;
      const double distance = (at(spring->to) - at(spring->from)).norm();
      if (distance > kCoincident * mechanism.length()) continue;
      const double tension = TensionAtZeroLength(*spring);
      if (tension == 0.0 && spring->damping == 0.0) continue;
      warnings.push_back(
          fmt::format("force {} ({}) has no direction at the start: its points coincide, and its "
                      "{} does not act",
                      i, NameOfForce(description, i),
                      tension == 0.0 ? "damping" : fmt::format("tension of {:.4g} N", tension)));
    }
    return warnings;
  });
}

std::vector<std::string> FindWarnings(const MechanismDescription& description,
                                      const Structure& structure) {
  std::vector<std::string> warnings = FindUnitWarnings(description);
  if (structure.start.outcome == Outcome::kInconsistentStart) {
    warnings.push_back(structure.start.message);
  } else {
    std::ranges::move(FindGuessWarnings(description, structure.start.q),
                      std::back_inserter(warnings));
    std::ranges::move(FindForceWarnings(description, structure.start.q),
                      std::back_inserter(warnings));
    if (!structure.start.has_given_speeds) {
      warnings.emplace_back(
          "the given speeds contradict each other by less than \"accuracy\": the nearest that fit "
          "replace them");
    }
  }
  AddRankWarnings(description, structure, &warnings);
  for (const Island& island : structure.islands) {
    if (island.grounded) continue;
    const std::vector<std::string> names =
        Mapped<std::string>(island.bodies, [&](int body) { return description.bodies[body].name; });
    warnings.push_back(
        fmt::format("unreachable from ground: no joint connects {}; it floats", Shortened(names)));
  }
  const auto [light, heavy] = std::ranges::minmax_element(
      description.bodies.begin() + 1, description.bodies.end(), {}, &BodyDescription::mass);
  if (heavy->mass > kLargestMassRatio * light->mass) {
    warnings.push_back(fmt::format("{} has {:.3g} times the mass of {}", heavy->name,
                                   heavy->mass / light->mass, light->name));
  }
  for (std::size_t body = 1; body < description.bodies.size(); ++body) {
    const double distance = structure.centre_distances[body];
    if (distance <= kFarthestCentre * structure.length) continue;
    warnings.push_back(fmt::format(
        "the centre of mass of {} is {:.3g} m from the middle of its joints, {:.3g} times the "
        "mechanism's length: positions lose as many digits",
        description.bodies[body].name, distance, distance / structure.length));
  }
  return warnings;
}

}  // namespace loopbench::harness
