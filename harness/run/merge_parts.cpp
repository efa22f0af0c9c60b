#include "harness/run/merge_parts.h"

#include <algorithm>
#include <cmath>

#include "harness/text/hash.h"
#include "mechanism/description/outcome.h"

namespace loopbench::harness {

namespace {

double Real(const Record& record, const std::string& key) { return record.Number(key); }

/// Sum of a key that some parts may lack; nothing when all do.
template <class Number>
void Add(std::span<const Run> parts, const std::string& key, Record* whole) {
  Number sum = 0;
  bool any = false;
  for (const Run& part : parts) {
    const double value = Real(part.record, key);
    if (std::isnan(value)) continue;
    sum += static_cast<Number>(value);
    any = true;
  }
  if (any) whole->Set(key, sum);
}

/// Largest (or smallest) of a key that some parts may lack; the part that has it.
const Run* Extreme(std::span<const Run> parts, const std::string& key, bool largest,
                   Record* whole) {
  const Run* best = nullptr;
  for (const Run& part : parts) {
    const double value = Real(part.record, key);
    if (std::isnan(value)) continue;
    const double known = best == nullptr ? value : Real(best->record, key);
    if (best == nullptr || (largest ? value > known : value < known)) best = &part;
  }
  if (best != nullptr) whole->Set(key, Real(best->record, key));
  return best;
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
  Record& record = whole.record;
  const auto failed = std::ranges::find_if(parts, [](const Run& part) {
    return part.record.Text("outcome") != ToString(Outcome::kFinished);
  });
  const Run& speaker = failed == parts.end() ? parts.front() : *failed;
  record.Set("outcome", speaker.record.Text("outcome"));
  record.Set("message", speaker.record.Text("message"));
  Extreme(parts, "t_reached", false, &record);
  for (const char* key :
       {"steps", "rejected", "rhs_evaluations", "rhs_equivalents", "projection_iterations",
        "restarts", "softened_steps", "softened_evaluations", "mode_changes",
        "singularity_passages", "newton_jacobians", "newton_rhs_evaluations",
        "newton_dual_evaluations", "newton_iterations", "newton_failures"}) {
    Add<std::int64_t>(parts, key, &record);
  }
  const bool started = std::ranges::all_of(
      parts, [](const Run& part) { return !std::isnan(Real(part.record, "rank_min")); });
  for (const char* key : {"rank_min", "rank_constraints_min"}) {
    if (started) Add<std::int64_t>(parts, key, &record);
  }
  double wall = 0.0, energy = 0.0;
  std::string hashes;
  for (const Run& part : parts) {
    wall += Real(part.record, "wall_s");
    energy += Real(part.record, "energy_error_max");
    hashes += part.record.Text("state_hash");
    for (const auto& [key, value] : part.record.items()) {
      if (key.starts_with("drift.loop.") || key.starts_with("series.final.")) {
        record.Set(key, value);
      }
    }
  }
  record.Set("wall_s", wall);
  for (const char* key : {"cpu_s", "energy_supplied", "energy_dissipated", "energy_scale"}) {
    Add<double>(parts, key, &record);
  }
  if (started) {
    record.Set("energy_error_max", energy);
    record.Set("state_hash", Fnv1a(hashes));
  }
  const Run* worst = Extreme(parts, "drift_position_max", true, &record);
  if (worst != nullptr) record.Set("worst_loop", worst->record.Text("worst_loop"));
  for (const char* key : {"drift_rotation_max", "drift_velocity_max", "drift_acceleration_max",
                          "loop_closure_max", "correction_max"}) {
    Extreme(parts, key, true, &record);
  }
  const Run* lowest = Extreme(parts, "rcond_min", false, &record);
  if (lowest != nullptr) record.Set("rcond_min_t", Real(lowest->record, "rcond_min_t"));
  const Run* nearest = Extreme(parts, "singularity_distance_min", false, &record);
  if (nearest != nullptr) {
    record.Set("singularity_distance_min_t", Real(nearest->record, "singularity_distance_min_t"));
  }
  whole.drift = MergeDrift(parts);
  return whole;
}

}  // namespace loopbench::harness
