#include "harness/run/merge_parts.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <string_view>
#include <utility>

#include "harness/record/measures.h"
#include "harness/text/hash.h"
#include "mechanism/description/outcome.h"

namespace loopbench::harness {

namespace {

/// Sum of a key over the parts that have it, or NaN where one of `all` lacks it; nothing where none
/// has it.
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

/// The part that decides a key: the one with the largest or smallest number of those that have it,
/// the first one that failed, ...; null where none has it.
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

/// The value of a key for the whole; nothing where it has none.
Value MergeKey(std::span<const Run> parts, const Measure& measure, std::string_view key) {
  const bool started = std::ranges::all_of(
      parts, [](const Run& part) { return !std::isnan(part.record.Number("rank_min")); });
  switch (measure.merging.how) {
    case Merge::kLost:
      return {};
    case Merge::kSum:
      return Sum(parts, key, false);
    case Merge::kSumOfAll:
      return started ? Sum(parts, key, true) : Value();
    case Merge::kHashOfAll: {
      std::string all;
      for (const Run& part : parts) all += part.record.Text(key);
      return started ? Value(Fnv1a(all)) : Value();
    }
    case Merge::kLargest:
    case Merge::kSmallest:
    case Merge::kWith:
    case Merge::kOfEnding:
    case Merge::kOfEachPart:
      break;
  }
  const Run* part = Deciding(parts, measure, key);
  return part == nullptr || part->record.Find(key) == nullptr ? Value() : *part->record.Find(key);
}

/// At every time of any part the largest of what the parts had last.
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
  return whole;
}

}  // namespace loopbench::harness
