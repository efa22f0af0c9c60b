#include "harness/reference/error_meter.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace loopbench::harness {

ErrorMeter::ErrorMeter(const Measured& measured, int part, const Reference& reference)
    : measured_(measured),
      part_(part),
      reference_(reference),
      times_(reference.times.begin(),
             reference.times.begin() + static_cast<std::ptrdiff_t>(reference.NumTrusted())) {}

void ErrorMeter::Add(std::size_t k, const Snapshot& own, const Snapshot& lower) {
  if (k >= times_.size()) return;
  if (at_.empty()) first_energy_ = own.energy;
  Distance distance = DistanceOf(measured_, part_, own, reference_.snapshots[k]);
  distance.energy = std::abs(own.energy - first_energy_ - reference_.snapshots[k].energy +
                             reference_.snapshots.front().energy);
  // a run of one part knows its own energy only
  if (measured_.compiled.parts.size() > 1 || k == 0 || at_.empty()) {
    distance.energy = k == 0 ? 0.0 : std::nan("");
  }
  at_.push_back(k);
  distances_.push_back(distance);
  interpolation_ = std::max(interpolation_, DistanceOf(measured_, part_, own, lower).position);
}

void ErrorMeter::Write(Record& record) const {
  if (at_.empty()) return;
  Distance largest;
  double squares = 0.0;
  std::vector<double> t, error;
  for (std::size_t i = 0; i < at_.size(); ++i) {
    largest = Larger(largest, distances_[i]);
    squares += distances_[i].position * distances_[i].position;
    t.push_back(times_[at_[i]]);
    error.push_back(distances_[i].position);
  }
  // where everything all but stands still, being late has no meaning
  constexpr double kMoves = 0.01;
  double late = 0.0, shape = 0.0;
  for (const Distance& one : distances_) {
    const bool moves = one.speed > kMoves * largest.speed;
    if (moves) late = std::max(late, std::abs(one.late));
    shape = std::max(shape, moves ? one.shape : one.position);
  }
  if (times_[at_.back()] == reference_.times.back()) {
    record.Set("error_position_end", error.back());
  }
  record.Set("error_position_max", largest.position);
  record.Set("error_position_rms", std::sqrt(squares / static_cast<double>(at_.size())));
  record.Set("error_rotation_max", largest.rotation);
  record.Set("error_velocity_max", largest.velocity);
  record.Set("error_angular_velocity_max", largest.angular_velocity);
  record.Set("error_angle_max", largest.angle);
  record.Set("error_displacement_max", largest.displacement);
  if (measured_.compiled.parts.size() == 1) record.Set("error_energy_max", largest.energy);
  record.Set("error_phase_max", late);
  record.Set("error_shape_max", shape);
  record.Set("error_interpolation_max", interpolation_);
  record.Set("error_points", static_cast<std::int64_t>(at_.size()));
  record.Set("series.error_t", std::move(t));
  record.Set("series.error", std::move(error));
}

void WriteCertificate(const Reference& reference, Record& record) {
  record.Set("reference",
             reference.snapshots.empty()
                 ? fmt::format("none: {}",
                               reference.message.empty() ? reference.outcome : reference.message)
                 : reference.scalar);
  if (reference.snapshots.empty()) return;
  record.Set("reference_witnesses", reference.witnesses);
  record.Set("reference_error", reference.Certified().position);
  record.Set("trust_horizon", reference.trust_horizon);
}

}  // namespace loopbench::harness
