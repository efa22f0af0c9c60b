// Equation numbers refer to the O-DCA paper (odca/README.md has the index). Frames: W is Ground, F
// is fixed on body P of a joint and M on its body Q; X_AB is the pose of B in A, and R_AB takes
// components from B axes to A axes. All vectors are in ground axes unless a name ends in _F.
#include "mechanism/model/kinematics.h"

#include <algorithm>
#include <cmath>
#include <numbers>
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

// Directions H and D of the joints at the current poses, and which of them are imposed.

namespace {

/// [H D] in ground axes, F having the axes R = R_WF. Each column is a rotation about one axis of F
/// or a shift along one, all different, so D^T H = 0 holds as it is (9). Shifts may be along the
/// axes of ground. The plane has one axis to rotate about, which is normal to it.
template <class Space, class S>
void SetBasis(const JointKind<Space, S>& kind, const Rotation<Space, S>& R, bool ground_shifts,
              Basis<Space, S>& basis) {
  for (int i = 0; i < Space::kDim; ++i) {
    const int axis = kind.axes[i];
    basis[i].setZero();
    if (axis >= Space::kRot) {
      const int shift = axis - Space::kRot;
      basis[i].linear = ground_shifts ? Linear<Space, S>::Unit(shift) : R.col(shift);
    } else if constexpr (Space::kRot == 1) {
      basis[i].angular[0] = S(1);
    } else {
      basis[i].angular = R.col(axis);
    }
  }
}

/// [H D] in ground axes of a kind whose directions depend on its pose: the kind gives them in F
/// axes, and R = R_WF turns both halves, angular and linear.
template <class Space, class S>
void SetBasisAt(const JointKind<Space, S>& kind, const Rotation<Space, S>& R,
                const Pose<Space, S>& X_FM, Basis<Space, S>& basis) {
  kind.basis(X_FM, basis, kind.parameter);
  // kinds with basis_rate have exact tilts; their shifts are the axes themselves
  const bool shifts_along_axes = kind.basis_rate != nullptr && !kind.has_screws;
  for (int i = 0; i < Space::kDim; ++i) {
    const bool turns = kind.axes[i] < Space::kRot;
    if (!turns && shifts_along_axes) {
      basis[i].linear = R.col(kind.axes[i] - Space::kRot);
      continue;
    }
    if constexpr (Space::kRot == 3) {
      if (turns || kind.has_screws) basis[i].angular = R * basis[i].angular;
    }
    if (!turns || kind.has_screws) basis[i].linear = R * basis[i].linear;
  }
}

/// Step of central differences: rounding and truncation errors are alike, 4e-11.
constexpr double kRelativeStep = 6e-6;

/// A pose that moves with V (in F axes) for a short time.
template <class Space, class S>
Pose<Space, S> Moved(Pose<Space, S> X, const Velocity<Space, S>& V, S time) {
  if constexpr (Space::kRot == 1) {
    X.SetAngle(X.angle + time * V.angular[0]);
  } else {
    for (int j = 0; j < 3; ++j) {
      const Linear<Space, S> turn = V.angular.cross(X.R.col(j)) * time;
      for (int i = 0; i < 3; ++i) X.R(i, j) += turn[i];
    }
  }
  X.p += V.linear * time;
  return X;
}

/// Ground axes are valid for H and D if their spans do not depend on axes: nothing is prescribed or
/// released.
template <class Space, class S>
bool AnyAxes(const Joint<Space, S>& joint) {
  return joint.kind->rotation_invariant && joint.num_drives == 0 && joint.num_released == 0;
}

/// Ground axes are valid for shifts if D spans all of them. Products with them cost nothing.
template <class Space, class S>
bool HasGroundShifts(const Joint<Space, S>& joint) {
  const auto H = std::span(joint.kind->axes).first(joint.kind->num_u);
  return joint.num_drives == 0 && joint.num_released == 0 &&
         std::ranges::none_of(H, [](int axis) { return axis >= Space::kRot; });
}

}  // namespace

/// Fixed directions are set once: directions whose span needs no axes, and directions of joints on
/// Ground, for which X_PF fixes F. UpdatePosition() sets the others.
template <class Space, class S>
void Kinematics<Space, S>::Release(const std::vector<Released>& released) {
  released_ = released;
  moving_rows_.clear();
  for (const Released& out : released_) {
    const int first = Space::kDim - static_cast<int>(out.directions.size());
    for (int i = 0; i < static_cast<int>(out.directions.size()); ++i) {
      if (out.IsMoving(out.directions[i])) moving_rows_.push_back({out.joint, first + i});
    }
  }
  for (int j = 0; j < static_cast<int>(joints_.size()); ++j) {
    const Joint<Space, S>& joint = mechanism_->joints()[j];
    if (joint.kind->basis != nullptr) continue;
    SetDirections(j, AnyAxes(joint) ? Rotation<Space, S>::Identity() : joint.X_PF.R);
  }
}

/// Rows count prescribed coordinates, then the kind's D without the released directions, then the
/// released ones; each released direction before the row moves it one place on.
template <class Space, class S>
int Kinematics<Space, S>::DirectionOf(int index, int row) const {
  const Joint<Space, S>& joint = mechanism_->joints()[index];
  int direction = row - joint.num_drives;
  const auto out = std::ranges::find(released_, index, &Released::joint);
  if (out == released_.end()) return direction;
  const int kept = joint.num_constraints() - joint.num_drives;
  if (direction >= kept) return out->directions[direction - kept];
  for (const int released : out->directions) direction += released <= direction;
  return direction;
}

/// Directions of prescribed coordinates go from H to the head of D, released ones to its end.
template <class Space, class S>
template <class Columns>
void Kinematics<Space, S>::OrderDirections(int index, Columns& columns) const {
  const Joint<Space, S>& joint = mechanism_->joints()[index];
  if (joint.num_drives > 0) {
    const Columns all = columns;
    int free = 0, driven = joint.num_u();
    for (int i = 0; i < joint.kind->num_u; ++i) {
      columns[mechanism_->DriveOf(joint, i) >= 0 ? driven++ : free++] = all[i];
    }
  }
  if (joint.num_released == 0) return;
  const std::vector<int>& out = std::ranges::find(released_, index, &Released::joint)->directions;
  Columns released;
  const int first = joint.kind->num_u, count = joint.num_released;
  for (int next = 0, i = 0, kept = first; i < joint.kind->num_constraints(); ++i) {
    if (next < count && out[next] == i) {
      released[next++] = columns[first + i];
    } else if (kept++ != first + i) {
      columns[kept - 1] = columns[first + i];
    }
  }
  for (int i = 0; i < count; ++i) columns[Space::kDim - count + i] = released[i];
}

/// [H D] in ground axes.
template <class Space, class S>
void Kinematics<Space, S>::SetDirections(int index, const Rotation<Space, S>& R_WF) {
  const Joint<Space, S>& joint = mechanism_->joints()[index];
  Basis<Space, S>& basis = joints_[index].basis;
  if (joint.kind->basis != nullptr) {
    SetBasisAt<Space, S>(*joint.kind, R_WF, joint_poses_[index], basis);
  } else {
    SetBasis<Space, S>(*joint.kind, R_WF, HasGroundShifts(joint), basis);
  }
  OrderDirections(index, basis);
}

template <class Space, class S>
std::array<DirectionParts, Space::kDim> Kinematics<Space, S>::PartsOf(int index) const {
  const JointKind<Space, S>& kind = *mechanism_->joints()[index].kind;
  std::array<DirectionParts, Space::kDim> parts;
  for (int i = 0; i < Space::kDim; ++i) {
    const bool turns = kind.axes[i] < Space::kRot;
    parts[i].turns = turns || kind.has_screws;
    parts[i].shifts = !turns || kind.has_screws;
    parts[i].moves = kind.basis_rate != nullptr ? parts[i].turns : kind.basis != nullptr;
  }
  OrderDirections(index, parts);
  return parts;
}

template <class Space, class S>
void Kinematics<Space, S>::OwnRates(int index, const std::array<DirectionParts, Space::kDim>& parts,
                                    int count, Basis<Space, S>& rates) const {
  const Joint<Space, S>& joint = mechanism_->joints()[index];
  const JointState<Space, S>& state = joints_[index];
  if (joint.kind->basis == nullptr) return;
  const Rotation<Space, S> R_WF = poses_[joint.from].R * joint.X_PF.R;
  const Velocity<Space, S> V = Rotate<Space, S>(R_WF.transpose(), state.V_rel);
  if (joint.kind->basis_rate != nullptr) {
    joint.kind->basis_rate(joint_poses_[index], V, rates);
  } else {
    const S speed = state.V_rel.angular.norm() + state.V_rel.linear.norm() / mechanism_->length();
    const S step = speed > S(0) ? S(kRelativeStep) / speed : S(1);
    Basis<Space, S> behind;
    joint.kind->basis(Moved(joint_poses_[index], V, step), rates, joint.kind->parameter);
    joint.kind->basis(Moved(joint_poses_[index], V, -step), behind, joint.kind->parameter);
    for (int i = 0; i < Space::kDim; ++i) rates[i] = (rates[i] - behind[i]) / (S(2) * step);
  }
  OrderDirections(index, rates);
  for (int i = 0; i < count; ++i) {
    if (!parts[i].moves) continue;
    if constexpr (Space::kRot == 3) {
      if (parts[i].turns) rates[i].angular = R_WF * rates[i].angular;
    }
    if (parts[i].shifts) rates[i].linear = R_WF * rates[i].linear;
  }
}

/// [H D] of a joint whose directions move.
template <class Space, class S>
void Kinematics<Space, S>::FollowDirections(int index, const Rotation<Space, S>& R_WF) {
  const Joint<Space, S>& joint = mechanism_->joints()[index];
  if (joint.kind->basis != nullptr) {
    if constexpr (Space::kRot == 1) {
      joint_poses_[index].R = R_WF.transpose() * (poses_[joint.to].R * joint.X_QM.R);
    }
    SetDirections(index, R_WF);
  } else if (!AnyAxes(joint) && (joint.from != kGround || joint.num_released > 0)) {
    SetDirections(index, R_WF);
  }
}

// Measured values of joints at the current poses and motions: violations, coordinates, speeds.

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
    using std::remainder;
    if (joint.kind->IsAngle(coordinate)) miss = remainder(miss, S(2 * std::numbers::pi_v<S>));
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
  if (!joint.kind->IsAngle(0)) return q;
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
    other.ForEachFree(joint, joint.kind->num_q,
                      [&](int i, int free) { q[joint.q_offset + free] = all[i]; });
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

#define LOOPBENCH_INSTANTIATE(Space, S) template class Kinematics<Space, S>;
LOOPBENCH_FOR_EACH_SPACE_AND_MODEL_SCALAR(LOOPBENCH_INSTANTIATE)
#undef LOOPBENCH_INSTANTIATE

}  // namespace loopbench
