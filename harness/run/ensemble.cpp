#include "harness/run/ensemble.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <random>

#include "mechanism/start/assembly.h"

namespace loopbench::harness {
namespace {

// Errors of a member's run whose largest is kept.
constexpr std::array kErrors = {"branch_error_max", "closed_form_error_max", "energy_error_max",
                                "drift_position_max"};

// Steps of a continuation [rad or m]: guesses are off by the square of it, a hundredth, which is
// nearer than another branch but where they cross.
constexpr double kLongestStep = 0.1;

bool IsHeld(const MechanismDescription& description, int joint) {
  return std::ranges::find(description.initial.held, joint) != description.initial.held.end();
}

MechanismDescription Drawn(MechanismDescription description, const Case& one, int member) {
  std::seed_seq sequence{one.seed, static_cast<std::uint64_t>(member)};
  std::mt19937_64 generator(sequence);
  for (const DrawnCoordinate& drawn : one.between) {
    // 53 random bits: the same number with every standard library
    const double unit = static_cast<double>(generator() >> 11) * 0x1p-53;
    for (JointValues& values : description.initial.coordinates) {
      if (description.joints[values.joint].name != drawn.joint) continue;
      values.values[0] = drawn.from + (drawn.to - drawn.from) * unit;
    }
  }
  return description;
}

// Guesses for all coordinates of tree joints that are not held.
template <class Space>
void SetGuesses(const Mechanism<Space, double>& mechanism, const VectorX<double>& q,
                MechanismDescription* description) {
  std::vector<JointValues>& list = description->initial.coordinates;
  for (const TreeStep& step : mechanism.tree()) {
    const int index = static_cast<int>(step.joint);
    const Joint<Space, double>& joint = mechanism.joints()[index];
    if (joint.num_q() == 0 || IsHeld(*description, index)) continue;
    auto values = std::ranges::find(list, index, &JointValues::joint);
    if (values == list.end()) values = list.insert(list.end(), {index, {}});
    values->values.assign(static_cast<std::size_t>(joint.kind->num_q), 0.0);
    for (int i = 0, next = joint.q_offset; i < joint.kind->num_q; ++i) {
      if (mechanism.DriveOf(joint, i) < 0) values->values[static_cast<std::size_t>(i)] = q[next++];
    }
  }
}

// `from` with its held coordinates those of `to`, reached in `steps` steps.
template <class Space>
MechanismDescription Follow(const MechanismDescription& from, const MechanismDescription& to,
                            int steps) {
  const Mechanism<Space, double> mechanism(from, Coordinates::kJoint);
  MechanismDescription at = from;
  VectorX<double> before;
  for (int k = 0; k <= steps; ++k) {
    const double part = static_cast<double>(k) / steps;
    for (std::size_t j = 0; j < from.initial.coordinates.size(); ++j) {
      const JointValues &first = from.initial.coordinates[j], &last = to.initial.coordinates[j];
      if (!IsHeld(from, first.joint)) continue;
      for (std::size_t i = 0; i < first.values.size(); ++i) {
        const double way = last.values[i] - first.values[i];
        at.initial.coordinates[j].values[i] =
            k == steps ? last.values[i] : first.values[i] + part * way;
      }
    }
    if (k == steps) return at;
    const Start<double> start = Assemble<Space>(at, mechanism);
    if (start.outcome == Outcome::kInconsistentStart) return to;
    // straight on from the last two: quaternions are normalised by the assembly
    SetGuesses(mechanism, k == 0 ? start.q : VectorX<double>(2.0 * start.q - before), &at);
    before = start.q;
  }
  return at;
}

// "OA = -1.5, AB = 0.2": who runs the member by itself sets these. Guesses decide about last bits;
// of large mechanisms they stay out.
std::string StartText(const MechanismDescription& description) {
  constexpr std::size_t kMostGuesses = 12;
  const std::vector<JointValues>& coordinates = description.initial.coordinates;
  std::string text;
  for (const JointValues& values : coordinates) {
    if (coordinates.size() > kMostGuesses && !IsHeld(description, values.joint)) continue;
    text += fmt::format("{}{} = {}", text.empty() ? "" : ", ",
                        description.joints[static_cast<std::size_t>(values.joint)].name,
                        fmt::join(values.values, " "));
  }
  return text;
}

}  // namespace

MechanismDescription MemberStart(const MechanismDescription& description, const Case& one,
                                 int member) {
  const MechanismDescription target = one.between.empty()
                                          ? Perturb(description, one.perturb, one.seed, member)
                                          : Drawn(description, one, member);
  double way = 0.0;
  for (std::size_t j = 0; j < description.initial.coordinates.size(); ++j) {
    const JointValues& from = description.initial.coordinates[j];
    const JointValues& to = target.initial.coordinates[j];
    for (std::size_t i = 0; i < from.values.size(); ++i) {
      way = std::max(way, std::abs(to.values[i] - from.values[i]));
    }
  }
  const int steps = static_cast<int>(std::ceil(way / kLongestStep));
  if (steps <= 1) return target;
  return description.space == SpaceKind::kPlanar ? Follow<Planar>(description, target, steps)
                                                 : Follow<Spatial>(description, target, steps);
}

bool EnsembleTally::StartsOnBranch(const Run& member) const {
  for (std::size_t i = 0; i < std::min(branch_start_.size(), member.branch_start.size()); ++i) {
    // body angles in space are known up to whole turns
    const double off =
        std::remainder(member.branch_start[i] - branch_start_[i], 2 * std::numbers::pi);
    if (!(std::abs(off) <= branch_bound_)) return false;
  }
  return true;
}

void EnsembleTally::Add(const Run& member, const MechanismDescription& start) {
  const Record& record = member.record;
  const auto named = [&] {
    return fmt::format("member {} ({}): {} at {:.4g} s{}{}", size_, StartText(start),
                       record.Text("outcome"), record.Number("t_reached"),
                       record.Text("message").empty() ? "" : ", ", record.Text("message"));
  };
  const bool starts_on = StartsOnBranch(member);
  started_off_ += starts_on ? 0 : 1;
  if (record.Text("outcome") != ToString(Outcome::kFinished)) {
    if (++failed_ == 1) first_failed_ = named();
  } else {
    const bool kept = starts_on && record.Number("branch_error_max") <= branch_bound_;
    kept_ += kept ? 1 : 0;
    if (!kept && first_left_.empty()) first_left_ = named();
    KeepLargest(record);
  }
  ++size_;
}

void EnsembleTally::KeepLargest(const Record& record) {
  for (const std::string key : kErrors) {
    if (record.Find(key) == nullptr) continue;
    const double value = record.Number(key), known = largest_.Number("ensemble_" + key);
    const bool is_first = largest_.Find("ensemble_" + key) == nullptr;
    const bool is_larger = !std::isnan(known) && !(value <= known);
    if (is_first || is_larger) largest_.Set("ensemble_" + key, value);
  }
}

void EnsembleTally::Write(Record& record) const {
  record.Set("ensemble_size", size_);
  record.Set("ensemble_failed", failed_);
  if (failed_ > 0) record.Set("ensemble_first_failed", first_failed_);
  for (const auto& [key, value] : largest_.items()) record.Set(key, value);
  if (branch_start_.empty()) return;
  record.Set("ensemble_branch_bound", branch_bound_);
  record.Set("ensemble_branch_kept", kept_);
  record.Set("ensemble_started_off", started_off_);
  if (!first_left_.empty()) record.Set("ensemble_first_left", first_left_);
}

}  // namespace loopbench::harness
