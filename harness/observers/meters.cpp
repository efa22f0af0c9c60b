// Errors of runs against references and published data.
#include <cmath>
#include <map>
#include <numbers>
#include <span>

#include "harness/base/text.h"
#include "harness/observers/reference.h"

namespace loopbench::harness {
namespace {

class ErrorMeter final : public Meter {
 public:
  ErrorMeter(const Measured& measured, int part, const Reference& reference)
      : measured_(measured),
        part_(part),
        reference_(reference),
        times_(reference.times.begin(),
               reference.times.begin() + static_cast<std::ptrdiff_t>(reference.NumTrusted())) {}

  const std::vector<double>& times() const override { return times_; }

  void Add(std::size_t k, const Snapshot& own, const Snapshot& lower) override {
    if (k >= times_.size()) return;
    if (at_.empty()) first_energy_ = own.energy;
    Distance distance = DistanceOf(measured_, part_, own, reference_.snapshots[k]);
    distance.energy = std::abs(own.energy - first_energy_ - reference_.snapshots[k].energy +
                               reference_.snapshots.front().energy);
    // a run of one subsystem has only its own energy
    if (measured_.compiled.parts.size() > 1 || k == 0 || at_.empty()) {
      distance.energy = k == 0 ? 0.0 : std::nan("");
    }
    at_.push_back(k);
    distances_.push_back(distance);
    interpolation_ = std::max(interpolation_, DistanceOf(measured_, part_, own, lower).position);
  }

  void Write(Record& record) const override {
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
    // time shift is undefined if nearly everything is at rest
    constexpr double kMoves = 0.01;
    double late = 0.0, shape = 0.0;
    for (const Distance& distance : distances_) {
      const bool moves = distance.speed > kMoves * largest.speed;
      if (moves) late = std::max(late, std::abs(distance.late));
      // a shift of zero is permitted, so the path error is at most the distance
      shape =
          std::max(shape, moves ? std::min(distance.shape, distance.position) : distance.position);
    }
    if (times_[at_.back()] == reference_.times.back()) {
      record.Set("error_position_end", error.back());
    }
    record.Set("error_position_max", largest.position);
    record.Set("error_position_rms", std::sqrt(squares / static_cast<double>(at_.size())));
    for (const auto& [name, part] : std::span(kDistances).subspan(1)) {
      if (part == &Distance::energy && measured_.compiled.parts.size() != 1) continue;
      record.Set(fmt::format("error_{}_max", name), largest.*part);
    }
    record.Set("error_phase_max", late);
    record.Set("error_path_max", shape);
    record.Set("error_interpolation_max", interpolation_);
    record.Set("error_points", static_cast<std::int64_t>(at_.size()));
    record.Set("series.error_t", std::move(t));
    record.Set("series.error", std::move(error));
  }

 private:
  Measured measured_;
  int part_;
  const Reference& reference_;
  std::vector<double> times_;
  std::vector<std::size_t> at_;  ///< which of them were added
  std::vector<Distance> distances_;
  double first_energy_ = 0.0, interpolation_ = 0.0;
};

constexpr const char* kPosition = "position";

/// The middle of the keys that a quantity's error and accuracy have: error_*_max.
std::string MeasureOf(const MechanismDescription& user, const PublishedQuantity& quantity) {
  const bool speed = quantity.is_speed;
  if (quantity.kind == PublishedKind::kPoint) return speed ? "velocity" : kPosition;
  if (quantity.kind == PublishedKind::kAngle) return speed ? "angular_velocity" : "rotation";
  const std::string measure = IsLength(user, quantity.index) ? "displacement" : "angle";
  return speed ? measure + "_rate" : measure;
}

bool IsAngle(const MechanismDescription& user, const PublishedQuantity& quantity) {
  if (quantity.is_speed || quantity.kind == PublishedKind::kPoint) return false;
  return quantity.kind == PublishedKind::kAngle || !IsLength(user, quantity.index);
}

/// Returns the maximum of each measure over the quantities, without NaN. The error of a point is
/// the root of the squares over its axes.
template <class ValueOf>
std::map<std::string, double> LargestOf(const MechanismDescription& user,
                                        const PublishedSeries& series, ValueOf value_of) {
  std::map<std::string, double> largest;
  // body, point and speed: the axes of one
  std::map<std::pair<std::string, std::pair<std::string, bool>>, double> squares;
  for (const PublishedQuantity& quantity : series.quantities) {
    double value = value_of(quantity);
    if (std::isnan(value)) continue;
    if (quantity.kind == PublishedKind::kPoint) {
      double& sum = squares[{quantity.body, {quantity.point, quantity.is_speed}}];
      sum += value * value;
      value = std::sqrt(sum);
    }
    double& known = largest.try_emplace(MeasureOf(user, quantity), 0.0).first->second;
    known = std::max(known, value);
  }
  return largest;
}

class SeriesMeter final : public Meter {
 public:
  SeriesMeter(const Measured& measured, int part, const PublishedSeries& series, double horizon)
      : measured_(measured),
        part_(part),
        series_(series),
        horizon_(horizon),
        times_(series.times.begin(),
               series.times.begin() + static_cast<std::ptrdiff_t>(series.NumWithin(horizon))) {}

  const std::vector<double>& times() const override { return times_; }

  void Add(std::size_t k, const Snapshot& own, const Snapshot& lower) override {
    if (k >= times_.size()) return;
    const auto errors = LargestOf(measured_.user, series_, [&](const PublishedQuantity& quantity) {
      const double difference = Difference(quantity, k, own);
      if (difference > over_accuracy_ * quantity.accuracy) {
        over_accuracy_ = difference / quantity.accuracy;
      }
      return difference;
    });
    if (errors.empty()) return;  // all of it belongs to other parts
    ++points_;
    interpolation_ = std::max(interpolation_, DistanceOf(measured_, part_, own, lower).position);
    for (const auto& [measure, error] : errors) {
      double& known = largest_.try_emplace(measure, 0.0).first->second;
      known = std::max(known, error);
      if (measure != kPosition) continue;
      at_.push_back(times_[k]);
      positions_.push_back(error);
    }
  }

  void Write(Record& record) const override {
    if (points_ == 0) return;
    for (const auto& [measure, error] : largest_) record.Set("error_" + measure + "_max", error);
    record.Set("error_over_uncertainty", over_accuracy_);
    record.Set("error_interpolation_max", interpolation_);
    record.Set("error_points", points_);
    if (positions_.empty()) return;
    double squares = 0.0;
    for (const double error : positions_) squares += error * error;
    record.Set("error_position_rms", std::sqrt(squares / static_cast<double>(positions_.size())));
    if (at_.back() == horizon_) record.Set("error_position_end", positions_.back());
    record.Set("series.error_t", at_);
    record.Set("series.error", positions_);
  }

 private:
  /// NaN where the part does not have it.
  double Difference(const PublishedQuantity& quantity, std::size_t k, const Snapshot& own) const {
    const double published = quantity.values[k];
    if (quantity.kind == PublishedKind::kJoint) {
      if (measured_.compiled.joints[quantity.index].part != part_) return std::nan("");
      const double value =
          quantity.is_speed ? own.rates[quantity.index] : own.joints[quantity.index];
      const double apart = value - published;
      return std::abs(
          IsAngle(measured_.user, quantity) ? std::remainder(apart, 2 * std::numbers::pi) : apart);
    }
    if (measured_.compiled.bodies[quantity.index].part != part_) return std::nan("");
    const BodyState& body = own.bodies[quantity.index];
    if (quantity.kind == PublishedKind::kAngle) {
      if (quantity.is_speed) return std::abs(body.angular_velocity.z() - published);
      const double angle = std::atan2(body.pose.R(1, 0), body.pose.R(0, 0));
      return std::abs(std::remainder(angle - published, 2 * std::numbers::pi));
    }
    const Eigen::Vector3d arm = body.pose.R * quantity.at;
    const Eigen::Vector3d vector =
        quantity.is_speed ? Eigen::Vector3d(body.velocity + body.angular_velocity.cross(arm))
                          : Eigen::Vector3d(body.pose.p + arm);
    return std::abs(vector[quantity.along] - published);
  }

  Measured measured_;
  int part_;
  const PublishedSeries& series_;
  double horizon_;
  std::vector<double> times_;
  std::map<std::string, double> largest_;  ///< by key of the record
  std::vector<double> at_, positions_;     ///< times and errors of points there
  double over_accuracy_ = 0.0, interpolation_ = 0.0;
  std::int64_t points_ = 0;
};

}  // namespace

std::unique_ptr<Meter> MakeMeter(const Measured& measured, int part, const Reference& reference) {
  return std::make_unique<ErrorMeter>(measured, part, reference);
}

std::unique_ptr<Meter> MakeMeter(const Measured& measured, int part, const PublishedSeries& series,
                                 double horizon) {
  return std::make_unique<SeriesMeter>(measured, part, series, horizon);
}

void WriteCertificate(const Reference& reference, Record& record) {
  record.Set("reference",
             reference.snapshots.empty()
                 ? fmt::format("none: {}",
                               reference.message.empty() ? reference.outcome : reference.message)
                 : reference.scalar);
  if (reference.snapshots.empty()) return;
  record.Set("reference_runs", reference.witnesses);
  record.Set("reference_error", reference.Certified().position);
  record.Set("reference_valid_until", reference.trust_horizon);
}

void WriteCertificate(const MechanismDescription& user, const PublishedSeries& series,
                      double horizon, Record& record) {
  const std::size_t count = series.NumWithin(horizon);
  if (count == 0) {
    record.Set("reference", fmt::format("none: \"{}\" begins at {} s, behind the horizon",
                                        series.name, series.times.front()));
    return;
  }
  record.Set("reference", std::string(kPublished));
  record.Set("reference_runs", fmt::format("{}: {}", series.name, series.source));
  const auto accuracies =
      LargestOf(user, series, [](const PublishedQuantity& quantity) { return quantity.accuracy; });
  for (const auto& [measure, accuracy] : accuracies) {
    record.Set(measure == kPosition ? "reference_error" : "reference_error_" + measure, accuracy);
  }
  record.Set("reference_valid_until", series.times[count - 1]);
}

}  // namespace loopbench::harness
