#include <algorithm>
#include <cmath>
#include <numbers>

#include "harness/observers/observer.h"

namespace loopbench::harness {

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

template class ExactObserver<Planar>;
template class ExactObserver<Spatial>;

}  // namespace loopbench::harness
