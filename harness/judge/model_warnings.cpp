#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <ranges>
#include <vector>

#include "harness/base/text.h"
#include "harness/judge/analysis.h"
#include "mechanism/loops/excursion.h"
#include "mechanism/start/poses.h"

namespace loopbench::harness {

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

constexpr std::size_t kMaxNames = 6;

/// Returns the first names with commas between them, "and 3 more" if there are more than six.
std::string Shortened(const std::vector<std::string>& names) {
  const std::string text = Joined(names | std::views::take(kMaxNames), ", ");
  if (names.size() <= kMaxNames) return text;
  return text + fmt::format(" and {} more", names.size() - kMaxNames);
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
      AddOnce(joints, '"' + description.joints[redundant.joint].name + '"');
    }
    warnings->push_back(fmt::format(
        "{} constraints of {} differ from dependent ones by {:.2g} rad or lengths, about the "
        "accuracy {:g} of the input: runs remove them",
        structure.redundant.size(), Joined(joints, ", "), structure.rounding,
        description.accuracy));
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

std::vector<std::string> FindWarnings(const MechanismDescription& description,
                                      const Structure& structure) {
  std::vector<std::string> warnings = FindUnitWarnings(description);
  if (structure.start.outcome == Outcome::kInconsistentStart) {
    warnings.push_back(structure.start.message);
  } else {
    std::ranges::move(FindGuessWarnings(description, structure.start.q),
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
