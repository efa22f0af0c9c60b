// Measured values of joints at the current poses and motions: violations, coordinates, speeds.
#include <cmath>
#include <numbers>

#include "mechanism/algebra/instantiate.h"
#include "mechanism/model/kinematics.h"

namespace loopbench {

template <class Space, class S>
Velocity<Space, S> Kinematics<Space, S>::ConstraintMismatch(int index) const {
  const Joint<Space, S>& joint = mechanism_->joints()[index];
  Velocity<Space, S> mismatch = Rotate<Space, S>(poses_[joint.from].R * joint.X_PF.R,
                                                 Mismatch(*joint.kind, joint_poses_[index]));
  if (joint.num_drives == 0) return mismatch;
  S q[7];
  joint.kind->coordinates(joint_poses_[index], q, joint.kind->parameter);
  for (int k = 0; k < joint.num_drives; ++k) {
    const int drive = joint.first_drive + k, coordinate = mechanism_->drives()[drive].coordinate;
    S miss = q[coordinate] - drives_[drive].value;
    // an angle is measured modulo a turn; the shift of a helix determines the turn
    const bool angle = joint.kind->axes[coordinate] < Space::kRot && joint.kind->parameter == S(0);
    using std::remainder;
    if (angle) miss = remainder(miss, S(2 * std::numbers::pi_v<S>));
    mismatch += joints_[index].D(k) * miss;
  }
  return mismatch;
}

template <class Space, class S>
Components<Space, S> Kinematics<Space, S>::ConstraintSpeed(int index) const {
  const Joint<Space, S>& joint = mechanism_->joints()[index];
  const JointState<Space, S>& state = joints_[index];
  Components<Space, S> speed = state.Along(state.V_rel, state.rows());
  for (int k = 0; k < joint.num_drives; ++k) {
    speed[k] -= drives_[joint.first_drive + k].rate / joint.kind->inverse_H_squared;
  }
  return speed;
}

template <class Space, class S>
S Kinematics<Space, S>::JointCoordinate(int index) const {
  const Joint<Space, S>& joint = mechanism_->joints()[index];
  if (joint.in_tree()) {
    return joint.num_drives > 0 ? drives_[joint.first_drive].value : q_[joint.q_offset];
  }
  const S q = Measured(index);
  if (joint.kind->parameter != S(0)) return q;  // the shift of a helix determines its turns
  if (joint.kind->axes[0] >= Space::kRot) return q;
  // In the plane angles of bodies count turns, but not from the joint's initial value.
  if constexpr (Space::kRot == 1) {
    return q + (turns_are_counted_ ? whole_turns_[index] : WholeTurns(index, q));
  }
  // Space measures an angle modulo a turn; take the value nearest to the prediction by the last
  // speed.
  using std::remainder;
  const S near = accepted_[index] + accepted_speeds_[index] * (time_ - accepted_time_);
  return near + remainder(q - near, S(2 * std::numbers::pi_v<S>));
}

template <class Space, class S>
S Kinematics<Space, S>::Measured(int index) const {
  const JointKind<Space, S>& kind = *mechanism_->joints()[index].kind;
  S q;
  kind.coordinates(joint_poses_[index], &q, kind.parameter);
  return q;
}

template <class Space, class S>
S Kinematics<Space, S>::WholeTurns(int index, const S& measured) const {
  using std::round;
  const Joint<Space, S>& joint = mechanism_->joints()[index];
  const S turn = 2 * std::numbers::pi_v<S>;
  const S near = joint.num_drives > 0 ? drives_[joint.first_drive].value : accepted_[index];
  return turn * round((near - measured) / turn);
}

template <class Space, class S>
S Kinematics<Space, S>::JointSpeed(int index) const {
  const Joint<Space, S>& joint = mechanism_->joints()[index];
  if (joint.in_tree()) {
    return joint.num_drives > 0 ? drives_[joint.first_drive].rate : u_[joint.u_offset];
  }
  return WrenchOfEffort<Space, S>(joints_[index].H(0), joint.kind->inverse_H_squared, S(1))
      .dot(joints_[index].V_rel);
}

template <class Space, class S>
S Kinematics<Space, S>::CouplingMismatch(int index) const {
  const Coupling<S>& coupling = mechanism_->couplings()[index];
  if (coupling.is_moving_row) {
    const MovingRow& row = moving_row(index);
    return direction(row).dot(ConstraintMismatch(row.joint));
  }
  S sum = -coupling.offset - turns_[index];
  for (const auto& [joint, ratio] : coupling.parts) sum += ratio * JointCoordinate(joint);
  return sum;
}

template <class Space, class S>
S Kinematics<Space, S>::CouplingSpeed(int index) const {
  const Coupling<S>& coupling = mechanism_->couplings()[index];
  if (coupling.is_moving_row) {
    const MovingRow& row = moving_row(index);
    return direction(row).dot(joints_[row.joint].V_rel);
  }
  S sum = S(0);
  for (const auto& [joint, ratio] : coupling.parts) sum += ratio * JointSpeed(joint);
  return sum;
}

template <class Space, class S>
void Kinematics<Space, S>::ForgetSteps() {
  for (int j = 0; j < static_cast<int>(accepted_.size()); ++j) {
    ContinueFrom(j, S(mechanism_->joints()[j].initial));
  }
}

template <class Space, class S>
void Kinematics<Space, S>::AcceptStep() {
  for (int index : mechanism_->constraints()) {
    if (mechanism_->joints()[index].kind->num_u != 1) continue;
    if (!turns_are_counted_) whole_turns_[index] = WholeTurns(index, Measured(index));
    accepted_[index] = JointCoordinate(index);
    if constexpr (Space::kRot == 3) accepted_speeds_[index] = JointSpeed(index);
  }
  turns_are_counted_ = true;
  accepted_time_ = time_;
}

template <class Space, class S>
void Kinematics<Space, S>::CountTurns() {
  using std::abs;
  constexpr double kOpen = 1e-3;  // of the smallest turn; less is a start that is not consistent
  for (std::size_t c = 0; c < turns_.size(); ++c) {
    turns_[c] = S(0);
    const std::vector<S>& measured = mechanism_->couplings()[c].measured_turns;
    if (measured.empty()) continue;
    const S open = CouplingMismatch(static_cast<int>(c));
    if (abs(open) > S(kOpen) * measured.back()) turns_[c] = open;
  }
}

template <class Space, class S>
template <class T>
void Kinematics<Space, S>::CountTurnsLike(const Kinematics<Space, T>& other) {
  accepted_.assign(other.accepted_.begin(), other.accepted_.end());
  accepted_speeds_.assign(other.accepted_speeds_.begin(), other.accepted_speeds_.end());
  turns_.assign(other.turns_.begin(), other.turns_.end());
  whole_turns_.assign(other.whole_turns_.begin(), other.whole_turns_.end());
  accepted_time_ = S(other.accepted_time_);
  turns_are_counted_ = other.turns_are_counted_;
}

template <class Space, class S>
Pose<Space, S> Kinematics<Space, S>::MeasuredPose(const Joint<Space, S>& joint) const {
  return Compose(Inverse(Compose(poses_[joint.from], joint.X_PF)),
                 Compose(poses_[joint.to], joint.X_QM));
}

template <class Space, class S>
VectorX<S> Kinematics<Space, S>::CoordinatesIn(const Mechanism<Space, S>& other) const {
  VectorX<S> q(other.num_q());
  for (const TreeStep& step : other.tree()) {
    const Joint<Space, S>& joint = other.joints()[step.joint];
    S all[7];
    joint.kind->coordinates(MeasuredPose(joint), all, joint.kind->parameter);
    for (int i = 0, next = joint.q_offset; i < joint.kind->num_q; ++i) {
      if (other.DriveOf(joint, i) < 0) q[next++] = all[i];
    }
  }
  return q;
}

template <class Space, class S>
VectorX<S> Kinematics<Space, S>::SpeedsIn(const Kinematics& other) const {
  VectorX<S> u(other.mechanism().num_u());
  for (const TreeStep& step : other.mechanism().tree()) {
    const Joint<Space, S>& joint = other.mechanism().joints()[step.joint];
    const JointState<Space, S>& state = other.joints()[step.joint];
    const Velocity<Space, S> V_rel = ShiftMotion<Space, S>(motions_[joint.to], state.r_Q) -
                                     ShiftMotion<Space, S>(motions_[joint.from], state.r_P);
    for (int i = 0; i < state.num_u; ++i) {
      u[joint.u_offset + i] = joint.kind->inverse_H_squared * state.H(i).dot(V_rel);
    }
  }
  return u;
}

#define LOOPBENCH_INSTANTIATE(Space, S)                                                      \
  template Velocity<Space, S> Kinematics<Space, S>::ConstraintMismatch(int) const;           \
  template Components<Space, S> Kinematics<Space, S>::ConstraintSpeed(int) const;            \
  template S Kinematics<Space, S>::JointCoordinate(int) const;                               \
  template S Kinematics<Space, S>::JointSpeed(int) const;                                    \
  template S Kinematics<Space, S>::CouplingMismatch(int) const;                              \
  template S Kinematics<Space, S>::CouplingSpeed(int) const;                                 \
  template void Kinematics<Space, S>::ForgetSteps();                                         \
  template void Kinematics<Space, S>::AcceptStep();                                          \
  template void Kinematics<Space, S>::CountTurns();                                          \
  template void Kinematics<Space, S>::CountTurnsLike(const Kinematics<Space, S>&);           \
  template VectorX<S> Kinematics<Space, S>::CoordinatesIn(const Mechanism<Space, S>&) const; \
  template VectorX<S> Kinematics<Space, S>::SpeedsIn(const Kinematics&) const;
LOOPBENCH_FOR_EACH_SPACE_AND_MODEL_SCALAR(LOOPBENCH_INSTANTIATE)
#undef LOOPBENCH_INSTANTIATE
template void Kinematics<Planar, Dual>::CountTurnsLike(const Kinematics<Planar, double>&);
template void Kinematics<Spatial, Dual>::CountTurnsLike(const Kinematics<Spatial, double>&);

}  // namespace loopbench
