#include <array>
#include <cmath>
#include <numbers>
#include <random>

#include "harness/base/text.h"
#include "harness/run/run.h"
#include "mechanism/description/outcome.h"

namespace loopbench::harness {
namespace {

/// Returns the sum of a key over the parts; NaN if one of `all` lacks it; nothing if none has it.
Value Sum(std::span<const Run> parts, std::string_view key, bool all) {
  std::int64_t count = 0;
  double sum = 0.0;
  bool any = false, is_count = true;
  for (const Run& part : parts) {
    const double value = part.record.Number(key);
    if (std::isnan(value) && all) return value;
    if (std::isnan(value)) continue;
    is_count = is_count && std::holds_alternative<std::int64_t>(*part.record.Find(key));
    count += static_cast<std::int64_t>(value);
    sum += value;
    any = true;
  }
  if (!any) return {};
  return is_count ? Value(count) : Value(sum);
}

/// Returns the part that decides a key, or null: the largest number, the first that failed, ...
const Run* Deciding(std::span<const Run> parts, const Measure& measure, std::string_view key) {
  const auto& [how, with] = measure.merging;
  if (how == Merge::kWith) return Deciding(parts, *FindMeasure(with), with);
  if (how == Merge::kOfEnding) {
    const auto failed = std::ranges::find_if(parts, [](const Run& part) {
      return part.record.Text("outcome") != ToString(Outcome::kFinished);
    });
    return failed == parts.end() ? &parts.front() : &*failed;
  }
  const Run* best = nullptr;
  for (const Run& part : parts) {
    const double value = part.record.Number(key);
    if (how == Merge::kOfEachPart ? part.record.Find(key) == nullptr : std::isnan(value)) continue;
    const double known = best == nullptr ? value : best->record.Number(key);
    const bool better =
        how == Merge::kLargest ? value > known : how == Merge::kSmallest && value < known;
    if (best == nullptr || better) best = &part;
  }
  return best;
}

/// Returns the value of a key for the whole; nothing if undefined.
Value MergeKey(std::span<const Run> parts, const Measure& measure, std::string_view key) {
  const Merge how = measure.merging.how;
  if (how == Merge::kLost) return {};
  if (how == Merge::kSum) return Sum(parts, key, false);
  if (how == Merge::kSumOfAll || how == Merge::kHashOfAll) {
    const bool started = std::ranges::all_of(
        parts, [](const Run& part) { return !std::isnan(part.record.Number("rank_min")); });
    if (!started) return {};
    if (how == Merge::kSumOfAll) return Sum(parts, key, true);
    std::string all;
    for (const Run& part : parts) all += part.record.Text(key);
    return Fnv1a(all);
  }
  const Run* part = Deciding(parts, measure, key);
  return part == nullptr || part->record.Find(key) == nullptr ? Value() : *part->record.Find(key);
}

/// Returns, at every time of any part, the maximum of the parts' last values.
DriftSeries MergeDrift(std::span<const Run> parts) {
  std::vector<std::pair<double, std::size_t>> order;  // time, part
  for (std::size_t p = 0; p < parts.size(); ++p) {
    for (const double t : parts[p].drift.t) order.emplace_back(t, p);
  }
  std::ranges::stable_sort(order, {}, &std::pair<double, std::size_t>::first);
  std::vector<std::size_t> next(parts.size(), 0);
  std::vector<double> last(parts.size(), 0.0);
  DriftSeries merged;
  for (std::size_t i = 0; i < order.size(); ++i) {
    const auto [t, p] = order[i];
    last[p] = parts[p].drift.value[next[p]++];
    if (i + 1 < order.size() && order[i + 1].first == t) continue;
    merged.t.push_back(t);
    merged.value.push_back(std::ranges::max(last));
  }
  return merged;
}

// Errors of a member's run whose largest is kept.
constexpr std::array kErrors = {"branch_error_max", "closed_form_error_max", "energy_error_max",
                                "drift_position_max"};

// Steps of a continuation [rad or m]: guesses are off by the square of it, a hundredth, which is
// nearer than another branch but where they cross.
constexpr double kLongestStep = 0.1;

bool IsHeld(const MechanismDescription& description, int joint) {
  return std::ranges::find(description.initial.held, joint) != description.initial.held.end();
}

MechanismDescription Drawn(MechanismDescription description, const Case& entry, int member) {
  std::seed_seq sequence{entry.seed, static_cast<std::uint64_t>(member)};
  std::mt19937_64 generator(sequence);
  for (const DrawnCoordinate& drawn : entry.between) {
    // 53 random bits: the same number with every standard library
    const double unit = static_cast<double>(generator() >> 11) * 0x1p-53;
    for (JointValues& values : description.initial.coordinates) {
      if (description.joints[values.joint].name != drawn.joint) continue;
      values.values[0] = drawn.from + (drawn.to - drawn.from) * unit;
    }
  }
  return description;
}

// Guesses for all coordinates of tree joints that are not fixed.
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

// `from` with its fixed coordinates taken from `to`, reached in `steps` steps.
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
  constexpr std::size_t kMaxGuesses = 12;
  const std::vector<JointValues>& coordinates = description.initial.coordinates;
  std::string text;
  for (const JointValues& values : coordinates) {
    if (coordinates.size() > kMaxGuesses && !IsHeld(description, values.joint)) continue;
    text += fmt::format("{}{} = {}", text.empty() ? "" : ", ",
                        description.joints[static_cast<std::size_t>(values.joint)].name,
                        fmt::join(values.values, " "));
  }
  return text;
}

}  // namespace

Run MergeParts(std::span<const Run> parts) {
  if (parts.size() == 1) return parts.front();
  Run whole;
  for (const Run& part : parts) {
    for (const auto& [key, value] : part.record.items()) {
      const Measure* measure = FindMeasure(key);
      if (measure == nullptr || whole.record.Find(key) != nullptr) continue;
      Value merged = MergeKey(parts, *measure, key);
      if (!std::holds_alternative<std::monostate>(merged)) {
        whole.record.Append(key, std::move(merged));
      }
    }
  }
  whole.drift = MergeDrift(parts);
  whole.min_violation = std::ranges::max_element(parts, {}, &Run::min_violation)->min_violation;
  return whole;
}

MechanismDescription MemberStart(const MechanismDescription& description, const Case& entry,
                                 int member) {
  const MechanismDescription target = entry.between.empty()
                                          ? Perturb(description, entry.perturb, entry.seed, member)
                                          : Drawn(description, entry, member);
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
