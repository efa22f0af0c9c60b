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

/// Largest mismatch of some joints: points and rotations apart, and whose points are worst.
struct Largest {
  double shift = 0.0, rotation = 0.0;
  int joint = -1;

  template <class Space>
  void Add(const Kinematics<Space, double>& kinematics, int index) {
    // what a joint leaves free is no mismatch; what it releases because others hold it is
    const JointState<Space, double>& state = kinematics.joints()[index];
    const int all = state.directions();
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

template <class Space>
struct DriftObserver<Space>::Work {
  Work(const MechanismDescription& description, const Mechanism<Space, double>& mechanism)
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
  double shift = 0.0, rotation = 0.0, velocity = 0.0, acceleration = 0.0, closure = 0.0;
  std::string worst_loop;
};

template <class Space>
DriftObserver<Space>::DriftObserver(const MechanismDescription& description,
                                    const Mechanism<Space, double>& mechanism)
    : work_(std::make_unique<Work>(description, mechanism)) {}

template <class Space>
DriftObserver<Space>::~DriftObserver() = default;

template <class Space>
void DriftObserver<Space>::Observe(const Sample<Space>& sample) {
  Work& work = *work_;
  const Kinematics<Space, double>& kinematics = sample.formulation.kinematics();
  Largest now;
  work.dynamics.BodyAccelerations(kinematics, sample.formulation.udot(), work.A);
  for (int index : kinematics.mechanism().constraints()) {
    now.Add(kinematics, index);
    const JointState<Space, double>& state = kinematics.joints()[index];
    const int all = state.directions();
    const auto shift_of = [&](const Components<Space, double>& rows) {
      return state.Sum(rows, all).linear.norm();
    };
    Keep(&work.velocity, shift_of(state.Along(state.V_rel, all)));
    Keep(&work.acceleration, shift_of(JointAcceleration<Space, double>(kinematics, index, work.A)));
  }
  if (now.shift > work.shift) {
    work.worst_loop = kinematics.mechanism().joint_names()[now.joint];
  }
  Keep(&work.shift, now.shift);
  Keep(&work.rotation, now.rotation);
  series_.t.push_back(sample.t);
  series_.value.push_back(now.shift);

  const Kinematics<Space, double>& closure = work.view.At(kinematics);
  for (const auto& [index, name] : work.loop_names) {
    Largest loop;
    loop.Add(closure, index);
    Keep(&work.loop_max[index], loop.shift);
    Keep(&work.closure, loop.shift);
  }
}

template <class Space>
void DriftObserver<Space>::Write(Record& record) const {
  if (series_.t.empty()) return;
  record.Set("drift_position_max", work_->shift);
  record.Set("drift_rotation_max", work_->rotation);
  record.Set("drift_velocity_max", work_->velocity);
  record.Set("drift_acceleration_max", work_->acceleration);
  record.Set("loop_closure_max", work_->closure);
  record.Set("worst_loop", work_->worst_loop);
  for (const auto& [index, name] : work_->loop_names) {
    record.Set("drift.loop." + name, work_->loop_max[index]);
  }
}

template class DriftObserver<Planar>;
template class DriftObserver<Spatial>;

}  // namespace loopbench::harness
