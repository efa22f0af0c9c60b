#include <algorithm>
#include <cmath>

#include "harness/observers/joint_view.h"
#include "harness/observers/observer.h"
#include "mechanism/loops/tree_dynamics.h"

namespace loopbench::harness {

namespace {

/// Keeps the largest; one that is no number stays.
void Keep(double* largest, double value) {
  if (!std::isnan(*largest) && !(value <= *largest)) *largest = value;
}

/// Directions that a joint holds. A free direction has no mismatch. A direction released because
/// other joints hold it has one, unless they do so within the accuracy of the input only.
template <class Space>
int HeldDirections(const Kinematics<Space, double>& kinematics, int index) {
  const JointState<Space, double>& state = kinematics.joints()[index];
  return kinematics.mechanism().is_redundant() ? state.directions() : state.rows();
}

/// Largest mismatch of some joints: points and rotations apart, and whose points are worst.
struct Largest {
  double shift = 0.0, rotation = 0.0;
  int joint = -1;

  template <class Space>
  void Add(const Kinematics<Space, double>& kinematics, int index) {
    const JointState<Space, double>& state = kinematics.joints()[index];
    const int all = HeldDirections(kinematics, index);
    const Direction<Space, double> mismatch =
        state.Sum(state.Along(kinematics.ConstraintMismatch(index), all), all);
    Keep(&rotation, mismatch.angular.norm());
    const double s = mismatch.linear.norm();
    if (joint < 0 || !(s <= shift)) {
      shift = s;
      joint = index;
    }
  }
};

}  // namespace

/// What is watched besides positions.
template <class Space>
struct DriftObserver<Space>::Rest {
  Rest(const MechanismDescription& description, const Mechanism<Space, double>& mechanism)
      : dynamics(mechanism),
        A(mechanism.num_bodies()),
        view(description, mechanism, true),
        loop_max(mechanism.joints().size(), 0.0) {
    for (int index : view.mechanism().constraints()) {
      loop_names.emplace_back(index, view.mechanism().joint_names()[index]);
    }
  }

  TreeDynamics<Space, double> dynamics;
  std::vector<Acceleration<Space, double>> A;
  JointView<Space> view;
  std::vector<std::pair<int, std::string>> loop_names;
  std::vector<double> loop_max;
  double velocity = 0.0, acceleration = 0.0, closure = 0.0;
};

template <class Space>
DriftObserver<Space>::DriftObserver() = default;

template <class Space>
DriftObserver<Space>::DriftObserver(const MechanismDescription& description,
                                    const Mechanism<Space, double>& mechanism)
    : rest_(std::make_unique<Rest>(description, mechanism)) {}

template <class Space>
DriftObserver<Space>::~DriftObserver() = default;

template <class Space>
void DriftObserver<Space>::Observe(const Sample<Space>& sample) {
  const Kinematics<Space, double>& kinematics = sample.formulation.kinematics();
  Largest now;
  for (int index : kinematics.mechanism().constraints()) now.Add(kinematics, index);
  if (now.shift > shift_) worst_loop_ = kinematics.mechanism().joint_names()[now.joint];
  Keep(&shift_, now.shift);
  Keep(&rotation_, now.rotation);
  series_.t.push_back(sample.t);
  series_.value.push_back(now.shift);
  if (rest_ != nullptr) ObserveRest(sample);
}

template <class Space>
void DriftObserver<Space>::ObserveRest(const Sample<Space>& sample) {
  Rest& rest = *rest_;
  const Kinematics<Space, double>& kinematics = sample.formulation.kinematics();
  rest.dynamics.BodyAccelerations(kinematics, sample.formulation.udot(), rest.A);
  for (int index : kinematics.mechanism().constraints()) {
    const JointState<Space, double>& state = kinematics.joints()[index];
    const int all = HeldDirections(kinematics, index);
    const auto shift_of = [&](const Components<Space, double>& rows) {
      return state.Sum(rows, all).linear.norm();
    };
    Keep(&rest.velocity, shift_of(state.Along(state.V_rel, all)));
    Keep(&rest.acceleration, shift_of(JointAcceleration<Space, double>(kinematics, index, rest.A)));
  }
  const Kinematics<Space, double>& closure = rest.view.At(kinematics);
  for (const auto& [index, name] : rest.loop_names) {
    Largest loop;
    loop.Add(closure, index);
    Keep(&rest.loop_max[index], loop.shift);
    Keep(&rest.closure, loop.shift);
  }
}

template <class Space>
void DriftObserver<Space>::Write(Record& record) const {
  if (series_.t.empty()) return;
  record.Set("drift_position_max", shift_);
  record.Set("drift_rotation_max", rotation_);
  if (rest_ == nullptr) return;
  record.Set("drift_velocity_max", rest_->velocity);
  record.Set("drift_acceleration_max", rest_->acceleration);
  record.Set("loop_closure_max", rest_->closure);
  record.Set("worst_loop", worst_loop_);
  for (const auto& [index, name] : rest_->loop_names) {
    record.Set("drift.loop." + name, rest_->loop_max[index]);
  }
}

template class DriftObserver<Planar>;
template class DriftObserver<Spatial>;

}  // namespace loopbench::harness
