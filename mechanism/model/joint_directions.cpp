// Directions H and D of the joints at the current poses, and which of them are imposed. Frames and
// symbols: kinematics.cpp.
#include <algorithm>
#include <span>

#include "mechanism/algebra/instantiate.h"
#include "mechanism/model/kinematics.h"

namespace loopbench {

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
  for (int i = 0; i < Space::kDim; ++i) {
    const bool turns = kind.axes[i] < Space::kRot;
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
  if (joint.num_drives == 0 && joint.num_released == 0) return;
  const Columns all = columns;
  int free = 0, driven = joint.num_u();
  for (int i = 0; i < joint.kind->num_u; ++i) {
    columns[mechanism_->DriveOf(joint, i) >= 0 ? driven++ : free++] = all[i];
  }
  if (joint.num_released == 0) return;
  const std::vector<int>& out = std::ranges::find(released_, index, &Released::joint)->directions;
  int kept = joint.kind->num_u, last = Space::kDim - joint.num_released;
  for (int i = 0; i < joint.kind->num_constraints(); ++i) {
    const bool is_out = std::ranges::binary_search(out, i);
    columns[is_out ? last++ : kept++] = all[joint.kind->num_u + i];
  }
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

#define LOOPBENCH_INSTANTIATE(Space, S)                                                      \
  template void Kinematics<Space, S>::Release(const std::vector<Released>&);                 \
  template int Kinematics<Space, S>::DirectionOf(int, int) const;                            \
  template std::array<DirectionParts, Space::kDim> Kinematics<Space, S>::PartsOf(int) const; \
  template void Kinematics<Space, S>::OwnRates(                                              \
      int, const std::array<DirectionParts, Space::kDim>&, int, Basis<Space, S>&) const;     \
  template void Kinematics<Space, S>::FollowDirections(int, const Rotation<Space, S>&);
LOOPBENCH_FOR_EACH_SPACE_AND_MODEL_SCALAR(LOOPBENCH_INSTANTIATE)
#undef LOOPBENCH_INSTANTIATE

}  // namespace loopbench
