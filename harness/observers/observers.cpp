#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "harness/observers/observer.h"

namespace loopbench::harness {

namespace {

// Which of `n` samples stay: evenly spaced, always with the last one.
std::vector<std::size_t> Kept(std::size_t n, int points) {
  const std::size_t count = std::min(n, static_cast<std::size_t>(points));
  std::vector<std::size_t> kept(count);
  for (std::size_t i = 0; i < count; ++i) kept[i] = count == n ? i : i * (n - 1) / (count - 1);
  return kept;
}

// The largest distance of the first `samples` from the line through those that Thin() keeps.
double LargestGap(const TimeSeries& series, int points, std::size_t samples) {
  const std::vector<std::size_t> kept = Kept(samples, points);
  double gap = 0.0;
  for (std::size_t i = 1; i < kept.size(); ++i) {
    const std::size_t a = kept[i - 1], b = kept[i];
    const double slope = (series.value[b] - series.value[a]) / (series.t[b] - series.t[a]);
    for (std::size_t k = a + 1; k < b; ++k) {
      const double line = series.value[a] + slope * (series.t[k] - series.t[a]);
      gap = std::max(gap, std::abs(series.value[k] - line));
    }
  }
  return gap;
}

}  // namespace

TimeSeries Thin(const TimeSeries& series, int points, std::size_t samples) {
  TimeSeries thin;
  for (const std::size_t k : Kept(std::min(samples, series.t.size()), points)) {
    thin.t.push_back(series.t[k]);
    thin.value.push_back(series.value[k]);
  }
  return thin;
}

template <class Space>
void EnergyObserver<Space>::Observe(const Sample<Space>& sample) {
  supplied_ = sample.supplied;
  dissipated_ = sample.dissipated;
  const auto parts = ComputeEnergy(sample.formulation.kinematics());
  const double energy = parts.total() - supplied_ + dissipated_;
  kinetic_ = std::max(kinetic_, parts.kinetic);
  work_ = std::max({work_, std::abs(supplied_), std::abs(dissipated_)});
  if (!started_) {
    first_ = energy;
    potential_low_ = potential_high_ = parts.potential;
  }
  potential_low_ = std::min(potential_low_, parts.potential);
  potential_high_ = std::max(potential_high_, parts.potential);
  started_ = true;
  // written so that an energy that overflowed stays
  const double error = std::abs(energy - first_);
  if (!std::isnan(largest_) && !(error <= largest_)) largest_ = error;
  series_.t.push_back(sample.t);
  series_.value.push_back(energy - first_);
}

template <class Space>
void EnergyObserver<Space>::Write(Record& record) const {
  if (!started_) return;
  record.Set("energy_error_max", largest_);
  if (kinetic_ > 0.0) record.Set("energy_error_relative", largest_ / kinetic_);
  // an error of a hundredth of the scale is then a thousand round-offs of the potential
  constexpr double kLeast = 1e5 * std::numeric_limits<double>::epsilon();
  record.Set("energy_scale",
             std::max({kinetic_, work_, potential_high_ - potential_low_,
                       kLeast * std::max(std::abs(potential_low_), std::abs(potential_high_))}));
  if (has_power_) {
    record.Set("energy_supplied", supplied_);
    record.Set("energy_dissipated", dissipated_);
  }
  const TimeSeries thin = Thin(series_, points_);
  record.Set("series.energy_t", thin.t);
  record.Set("series.energy_error", thin.value);
}

template <class Space>
void CorrectionObserver<Space>::Observe(const Sample<Space>& sample) {
  if (sample.formulation.options().enforcement != Enforcement::kPosition) return;
  const Correction<double>& correction = sample.formulation.correction();
  largest_ = std::max(largest_, correction.shift);
  iterations_ += correction.iterations;
  series_.t.push_back(sample.t);
  series_.value.push_back(correction.shift);
}

template <class Space>
void CorrectionObserver<Space>::Write(Record& record) const {
  if (series_.t.empty()) return;
  record.Set("correction_max", largest_);
  record.Set("projection_iterations", iterations_);
}

template <class Space>
void ConditionObserver<Space>::Observe(const Sample<Space>& sample) {
  const Diagnostics& diagnostics = sample.formulation.diagnostics();
  rank_min_ = started_ ? std::min(rank_min_, diagnostics.rank) : diagnostics.rank;
  const Mechanism<Space, double>& mechanism = sample.formulation.kinematics().mechanism();
  beyond_joint_speeds_ = mechanism.num_u() - mechanism.num_joint_speeds();
  if (!started_ || diagnostics.rcond < rcond_min_) {
    rcond_min_ = diagnostics.rcond;
    rcond_t_ = sample.t;
  }
  if (diagnostics.smallest_weight < 1.0) ++softened_steps_;
  softened_evaluations_ = diagnostics.softened_evaluations;
  mode_changes_ = diagnostics.mode_changes;
  started_ = true;
}

template <class Space>
void ConditionObserver<Space>::Write(Record& record) const {
  if (!started_) return;
  record.Set("rank_min", std::int64_t{rank_min_});
  record.Set("rank_constraints_min", std::int64_t{rank_min_ + beyond_joint_speeds_});
  record.Set("rcond_min", rcond_min_);
  record.Set("rcond_min_t", rcond_t_);
  record.Set("softened_steps", softened_steps_);
  record.Set("softened_evaluations", softened_evaluations_);
  record.Set("mode_changes", mode_changes_);
}

template <class Space>
ExactObserver<Space>::ExactObserver(const SceneObservation& scene,
                                    const Mechanism<Space, double>& mechanism)
    : scene_(scene) {
  const auto find = [&](const std::string& name) {
    const auto it = std::ranges::find(mechanism.body_names(), name);
    return static_cast<int>(it - mechanism.body_names().begin());
  };
  for (const AngleCombination& combination : scene.branch_invariants) {
    combinations_.emplace_back();
    for (const auto& [name, factor] : combination) {
      combinations_.back().emplace_back(find(name), factor);
    }
  }
  if (scene.closed_form) pendulum_body_ = find(scene.closed_form->body);
  last_angle_.assign(mechanism.num_bodies(), 0.0);
}

namespace {

// Of a planar scene, in space the angle about z.
template <class Space>
double AngleOf(const Pose<Space, double>& X) {
  if constexpr (Space::kRot == 1) {
    return X.angle;
  } else {
    return std::atan2(X.R(1, 0), X.R(0, 0));
  }
}

}  // namespace

template <class Space>
std::vector<double> ExactObserver<Space>::BranchAt(
    const Kinematics<Space, double>& kinematics) const {
  std::vector<double> branch;
  for (const auto& combination : combinations_) {
    double value = 0.0;
    for (const auto& [body, factor] : combination) {
      value += factor * AngleOf<Space>(kinematics.poses()[body]);
    }
    branch.push_back(value);
  }
  return branch;
}

template <class Space>
double ExactObserver<Space>::BodyAngle(const Sample<Space>& sample, int body) {
  const double angle = AngleOf<Space>(sample.formulation.kinematics().poses()[body]);
  if constexpr (Space::kRot == 1) {
    return angle;
  } else {
    // continued from step to step
    const double turn = 2 * std::numbers::pi;
    last_angle_[body] += std::remainder(angle - last_angle_[body], turn);
    return last_angle_[body];
  }
}

template <class Space>
void ExactObserver<Space>::Observe(const Sample<Space>& sample) {
  double worst = 0.0;
  for (std::size_t c = 0; c < combinations_.size(); ++c) {
    double value = 0.0;
    for (const auto& [body, factor] : combinations_[c]) value += factor * BodyAngle(sample, body);
    if (!started_) first_.push_back(value);
    worst = std::max(worst, std::abs(value - first_[c]));
  }
  branch_error_ = std::max(branch_error_, worst);
  if (!combinations_.empty()) {
    branch_.t.push_back(sample.t);
    branch_.value.push_back(worst);
  }
  if (pendulum_body_ >= 0) {
    const PendulumForm& form = *scene_.closed_form;
    const double theta = BodyAngle(sample, pendulum_body_) - form.down_angle;
    if (!started_) {
      theta0_ = theta;
      omega0_ = sample.formulation.kinematics().motions()[pendulum_body_][Space::kRot - 1];
    }
    // the closed form takes an angle within half a turn; whole turns go along unchanged
    const double within = std::remainder(theta0_, 2 * std::numbers::pi);
    const double exact =
        theta0_ - within + PendulumAngle(form.frequency_squared, within, omega0_, sample.t);
    closed_form_error_ = std::max(closed_form_error_, std::abs(theta - exact));
  }
  started_ = true;
}

template <class Space>
void ExactObserver<Space>::Write(Record& record) const {
  if (!started_) return;
  if (!combinations_.empty()) {
    record.Set("branch_error_max", branch_error_);
    const TimeSeries thin = Thin(branch_, 200);
    record.Set("series.branch_t", thin.t);
    record.Set("series.branch", thin.value);
  }
  if (pendulum_body_ >= 0) record.Set("closed_form_error_max", closed_form_error_);
}

template <class Space>
void CoordinateObserver<Space>::Observe(const Sample<Space>& sample) {
  const Kinematics<Space, double>& kinematics = sample.formulation.kinematics();
  const auto& joints = kinematics.mechanism().joints();
  constexpr std::size_t kMostJoints = 1000;
  if (joints.size() > kMostJoints) return;
  const bool first = series_.empty();
  std::size_t s = 0;
  for (int j = 0; j < static_cast<int>(joints.size()); ++j) {
    if (joints[j].description < 0 || joints[j].kind->num_u != 1) continue;
    if (first) {
      // motions have their rotations first; a helix is told by its angle
      const bool shifts = joints[j].kind->axes[0] >= Space::kRot;
      keys_.push_back((shifts ? "displacement." : "angle.") +
                      kinematics.mechanism().joint_names()[j]);
      (shifts ? shifts_ : angles_).push_back(s);
      series_.emplace_back();
    }
    series_[s].t.push_back(sample.t);
    series_[s].value.push_back(kinematics.JointCoordinate(j));
    ++s;
  }
}

template <class Space>
void CoordinateObserver<Space>::WriteOpening(std::size_t samples, const std::string& prefix,
                                             const std::string& time, Record& record) const {
  for (std::size_t s = 0; s < series_.size(); ++s) {
    const TimeSeries thin = Thin(series_[s], points_, samples);
    if (s == 0) record.Set(time, thin.t);
    record.Set(prefix + keys_[s], thin.value);
  }
}

template <class Space>
bool CoordinateObserver<Space>::Shows(const std::vector<std::size_t>& group,
                                      std::size_t samples) const {
  if (samples <= static_cast<std::size_t>(points_)) return true;
  // a hundredth of the axis is four pixels of a figure
  constexpr double kVisible = 0.01;
  double low = std::numeric_limits<double>::infinity(), high = -low;
  for (const std::size_t s : group) {
    for (std::size_t i = 0; i < samples; ++i) {
      low = std::min(low, series_[s].value[i]);
      high = std::max(high, series_[s].value[i]);
    }
  }
  return std::ranges::all_of(group, [&](std::size_t s) {
    return LargestGap(series_[s], points_, samples) <= kVisible * (high - low);
  });
}

template <class Space>
void CoordinateObserver<Space>::Write(Record& record) const {
  if (series_.empty()) return;
  const std::size_t all = series_[0].t.size();
  WriteOpening(all, "series.", "series.t", record);
  std::size_t shown = all;
  while (!Shows(angles_, shown) || !Shows(shifts_, shown)) shown /= 2;
  if (shown < all) WriteOpening(shown, "series.opening.", "series.opening_t", record);
}

#define LOOPBENCH_INSTANTIATE(Space)        \
  template class EnergyObserver<Space>;     \
  template class CorrectionObserver<Space>; \
  template class ConditionObserver<Space>;  \
  template class ExactObserver<Space>;      \
  template class CoordinateObserver<Space>;
LOOPBENCH_INSTANTIATE(Planar)
LOOPBENCH_INSTANTIATE(Spatial)
#undef LOOPBENCH_INSTANTIATE

}  // namespace loopbench::harness
