// Equation numbers refer to the O-DCA paper (odca/README.md has the index). Frames: W is Ground, F
// is fixed on body P of a joint and M on its body Q; X_AB is the pose of B in A, and R_AB takes
// components from B axes to A axes. All vectors are in ground axes unless a name ends in _F.
#include "mechanism/model/kinematics.h"

#include <algorithm>
#include <cmath>
#include <span>
#include <type_traits>

#include "mechanism/algebra/instantiate.h"
#include "mechanism/algebra/lanes.h"

namespace loopbench {

namespace {

/// Sine and cosine of the angle of a planar pose; a scalar may overload it.
template <class S>
void SinesOfPose(const S& angle, S& sine, S& cosine) {
  using std::cos;
  using std::sin;
  sine = sin(angle);
  cosine = cos(angle);
}

/// Computes matrices of planar poses from their angles, in double as many at once as there are
/// lanes. The bits of a pose do not depend on its lane.
template <class S>
void SetMatrices(std::span<Pose<Planar, S>> poses) {
  if constexpr (std::is_same_v<S, double>) {
    while (!poses.empty()) {
      const std::size_t count = std::min<std::size_t>(kLanes, poses.size());
      Lanes angle{}, s, c;
      for (std::size_t i = 0; i < count; ++i) angle[i] = poses[i].angle;
      SinCos(angle, s, c);
      for (std::size_t i = 0; i < count; ++i) {
        if (std::abs(angle[i]) <= kLargestAngle) {
          poses[i].R = {c[i], -s[i], s[i], c[i]};
        } else {
          poses[i].SetAngle(angle[i]);
        }
      }
      poses = poses.subspan(count);
    }
  } else {
    for (Pose<Planar, S>& X : poses) {
      S s, c;
      SinesOfPose(X.angle, s, c);
      X.R = {c, -s, s, c};
    }
  }
}

}  // namespace

template <class Space, class S>
Kinematics<Space, S>::Kinematics(const Mechanism<Space, S>& mechanism)
    : mechanism_(&mechanism),
      poses_(mechanism.num_bodies()),
      motions_(mechanism.num_bodies(), Velocity<Space, S>::Zero()),
      joints_(mechanism.joints().size()),
      joint_poses_(joints_.size()),
      drives_(mechanism.drives().size()),
      accepted_(joints_.size(), S(0)),
      accepted_speeds_(joints_.size(), S(0)),
      turns_(mechanism.couplings().size(), S(0)),
      whole_turns_(joints_.size(), S(0)),
      q_(VectorX<S>::Zero(mechanism.num_q())),
      u_(VectorX<S>::Zero(mechanism.num_u())) {
  SetTime(S(0));
  ForgetSteps();
  for (std::size_t j = 0; j < joints_.size(); ++j) {
    const Joint<Space, S>& joint = mechanism.joints()[j];
    JointState<Space, S>& state = joints_[j];
    state.num_u = joint.num_u();
    state.num_rows = joint.num_constraints();
    state.V_rel.setZero();
    state.g.setZero();
  }
  Release(mechanism.released());
}

template <class Space, class S>
void Kinematics<Space, S>::SetTime(S t) {
  time_ = t;
  for (std::size_t d = 0; d < drives_.size(); ++d) {
    drives_[d] = mechanism_->drives()[d].value.At(t);
  }
}

/// Free coordinates come from q, prescribed ones from their drives at time().
template <class Space, class S>
const S* Kinematics<Space, S>::JointCoordinates(const Joint<Space, S>& joint, S* room) const {
  const S* given = q_.data() + joint.q_offset;
  if (joint.num_drives == 0) return given;
  for (int i = 0; i < joint.kind->num_q; ++i) {
    const int drive = mechanism_->DriveOf(joint, i);
    room[i] = drive >= 0 ? drives_[drive].value : *given++;
  }
  return room;
}

/// First half of the paper's first two sweeps, as a walk along the spanning tree: each body after
/// its parent, outwards from Ground. In the plane the angles go first, so that all sines and
/// cosines are taken at once.
template <class Space, class S>
void Kinematics<Space, S>::UpdatePosition(const Eigen::Ref<const VectorX<S>>& q) {
  q_ = q;
  ++position_version_;
  S room[7];
  for (const TreeStep& step : mechanism_->tree()) {
    const Joint<Space, S>& joint = mechanism_->joints()[step.joint];
    Pose<Space, S>& X_FM = joint_poses_[step.joint];
    joint.kind->transform(JointCoordinates(joint, room), X_FM, joint.kind->parameter);
    if constexpr (Space::kRot == 1) {
      const S parent = poses_[step.parent].angle;
      poses_[step.child].angle = step.sign > 0
                                     ? parent + joint.X_PF.angle + X_FM.angle - joint.X_QM.angle
                                     : parent + joint.X_QM.angle - X_FM.angle - joint.X_PF.angle;
    }
  }
  if constexpr (Space::kRot == 1) SetMatrices(std::span(poses_).subspan(1));
  for (const TreeStep& step : mechanism_->tree()) PlaceChild(step);
  for (const int index : mechanism_->constraints()) MeasureCut(index);
}

/// Along a tree joint
///
///   R_WQ = R_WP R_PF R_FM R_QM^T                       in the plane from the angle
///   r_P = R_WP p_PF + R_WF p_FM,   r_Q = R_WQ p_QM     the arms of Mo from the centres of mass
///   p_Q = p_P + r_P - r_Q                              forward, and backward the same for P
template <class Space, class S>
void Kinematics<Space, S>::PlaceChild(const TreeStep& step) {
  const Joint<Space, S>& joint = mechanism_->joints()[step.joint];
  JointState<Space, S>& state = joints_[step.joint];
  Pose<Space, S>&X_WP = poses_[joint.from], &X_WQ = poses_[joint.to];
  const Pose<Space, S>& X_FM = joint_poses_[step.joint];
  const bool forward = step.sign > 0;
  Rotation<Space, S> R_WF;
  if (forward || Space::kRot == 1) {
    R_WF = X_WP.R * joint.X_PF.R;
    if constexpr (Space::kRot > 1) X_WQ.R = R_WF * X_FM.R * joint.X_QM.R.transpose();
  } else {
    R_WF = X_WQ.R * joint.X_QM.R * X_FM.R.transpose();
    X_WP.R = R_WF * joint.X_PF.R.transpose();
  }
  state.r_P = X_WP.R * joint.X_PF.p + R_WF * X_FM.p;
  state.r_Q = X_WQ.R * joint.X_QM.p;
  if (forward) {
    X_WQ.p = X_WP.p + state.r_P - state.r_Q;
  } else {
    X_WP.p = X_WQ.p + state.r_Q - state.r_P;
  }
  FollowDirections(step.joint, R_WF);
}

/// The two body poses give a cut joint's X_FM; its point Mo is fixed on Q.
template <class Space, class S>
void Kinematics<Space, S>::MeasureCut(int index) {
  const Joint<Space, S>& joint = mechanism_->joints()[index];
  JointState<Space, S>& state = joints_[index];
  const Pose<Space, S>&X_WP = poses_[joint.from], &X_WQ = poses_[joint.to];
  Pose<Space, S>& X_FM = joint_poses_[index];
  const Rotation<Space, S> R_WF = X_WP.R * joint.X_PF.R;
  state.r_Q = X_WQ.R * joint.X_QM.p;
  state.r_P = X_WQ.p + state.r_Q - X_WP.p;
  X_FM.p = R_WF.transpose() * (state.r_P - X_WP.R * joint.X_PF.p);
  if constexpr (Space::kRot == 1) {
    X_FM.angle = X_WQ.angle + joint.X_QM.angle - (X_WP.angle + joint.X_PF.angle);
  } else {
    X_FM.R = R_WF.transpose() * (X_WQ.R * joint.X_QM.R);
  }
  FollowDirections(index, R_WF);
}

/// Second half: V of each body at its centre of mass from that of its parent, and g of each joint.
///
///   V_rel = H u,  V_child = S(-r_child) (S(r_parent) V_parent +- V_rel)        a tree joint
///   V_rel = S(r_Q) V_Q - S(r_P) V_P                                            a cut joint
///   g     = Hdot u + [w_P x w_rel; 2 w_P x v_rel] + D times given accelerations
///
/// S(r) shifts a motion from a point to the point at r from it. g is the part of (7) besides H
/// udot, for the points of P and Q that coincide with Mo: one w_P x v_rel because the axes turn
/// with P, another one because Mo slides along P. The same lines serve joints to Ground, one side
/// of which stands still (33-34), and both joints of a coupled loop (49-50).
template <class Space, class S>
void Kinematics<Space, S>::UpdateVelocity(const Eigen::Ref<const VectorX<S>>& u) {
  u_ = u;
  const auto finish = [&](int index, const Joint<Space, S>& joint) {
    JointState<Space, S>& state = joints_[index];
    const Angular<Space, S>& w_P = motions_[joint.from].angular;
    state.g = {CrossAngular<S>(w_P, state.V_rel.angular),
               S(2) * Cross<S>(w_P, state.V_rel.linear)};  // (7)
    if (joint.kind->bias != nullptr) AddBias(index, joint, state);
    for (int k = 0; k < joint.num_drives; ++k) {
      state.g += state.D(k) * drives_[joint.first_drive + k].acceleration;
    }
  };
  for (const TreeStep& step : mechanism_->tree()) {
    const Joint<Space, S>& joint = mechanism_->joints()[step.joint];
    JointState<Space, S>& state = joints_[step.joint];
    state.V_rel.setZero();
    for (int i = 0; i < state.num_u; ++i) {
      state.V_rel += state.H(i) * u[joint.u_offset + i];
    }
    for (int k = 0; k < joint.num_drives; ++k) {
      state.V_rel += state.D(k) * drives_[joint.first_drive + k].rate;
    }
    const bool forward = step.sign > 0;
    const Linear<Space, S>& r_parent = forward ? state.r_P : state.r_Q;
    const Linear<Space, S> to_child = forward ? -state.r_Q : -state.r_P;
    Velocity<Space, S> V = ShiftMotion<Space, S>(motions_[step.parent], r_parent);
    V += S(step.sign) * state.V_rel;
    motions_[step.child] = ShiftMotion<Space, S>(V, to_child);
    finish(step.joint, joint);
  }
  for (int index : mechanism_->constraints()) {
    const Joint<Space, S>& joint = mechanism_->joints()[index];
    JointState<Space, S>& state = joints_[index];
    state.V_rel = ShiftMotion<Space, S>(motions_[joint.to], state.r_Q) -
                  ShiftMotion<Space, S>(motions_[joint.from], state.r_P);
    finish(index, joint);
  }
}

/// g += Hdot u of (7), seen from F. The kind takes V_rel and gives Hdot u in F axes.
template <class Space, class S>
void Kinematics<Space, S>::AddBias(int index, const Joint<Space, S>& joint,
                                   JointState<Space, S>& state) const {
  const Rotation<Space, S> R = poses_[joint.from].R * joint.X_PF.R;
  const Velocity<Space, S> in_F = Rotate<Space, S>(R.transpose(), state.V_rel);
  state.g += Rotate(R, joint.kind->bias(joint_poses_[index], in_F));
}

/// n of (7) on centres of mass: A at c + r is S(r) A + n.
template <class Space, class S>
Acceleration<Space, S> Kinematics<Space, S>::Centripetal(int body,
                                                         const Linear<Space, S>& r) const {
  const Angular<Space, S>& w = motions_[body].angular;
  return {Angular<Space, S>::Zero(), Cross<S>(w, Cross<S>(w, r))};
}

/// R_WB I R_WB^T about the centre of mass; in the plane a number that no rotation changes.
template <class Space, class S>
typename Inertia<Space, S>::Matrix Kinematics<Space, S>::RotationalInertia(
    const Inertia<Space, S>& inertia, int body) const {
  if constexpr (Space::kRot == 1) {
    return inertia.rotational;
  } else {
    return poses_[body].R * inertia.rotational * poses_[body].R.transpose();
  }
}

/// R_WB I^-1 R_WB^T: the inverse in body axes is a constant.
template <class Space, class S>
typename Inertia<Space, S>::Matrix Kinematics<Space, S>::RotationalInverse(
    const Inertia<Space, S>& inertia, int body) const {
  if constexpr (Space::kRot == 1) {
    return inertia.rotational_inverse;
  } else {
    return poses_[body].R * inertia.rotational_inverse * poses_[body].R.transpose();
  }
}

#define LOOPBENCH_INSTANTIATE(Space, S) template class Kinematics<Space, S>;
LOOPBENCH_FOR_EACH_SPACE_AND_MODEL_SCALAR(LOOPBENCH_INSTANTIATE)
#undef LOOPBENCH_INSTANTIATE

}  // namespace loopbench
