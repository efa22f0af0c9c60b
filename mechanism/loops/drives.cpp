#include "mechanism/loops/drives.h"

#include <algorithm>

#include "mechanism/algebra/instantiate.h"

namespace loopbench {

template <class Space, class S>
Drives<Space, S>::Drives(const Mechanism<Space, S>& mechanism)
    : dynamics_(mechanism),
      A_(mechanism.num_bodies(), Acceleration<Space, S>::Zero()),
      F_(mechanism.num_bodies(), Wrench<Space, S>::Zero()) {}

/// `left` is D^T (A_Q - A_P - g) at Mo, the paper's (7) without udot, for the accelerations that
/// udot gives the bodies. `alone` is M^-1 times each body's wrench at its centre of mass.
template <class Space, class S>
bool Drives<Space, S>::Followed(const Kinematics<Space, S>& kinematics, const VectorX<S>& udot,
                                const VectorX<S>& feedback) {
  dynamics_.BodyAccelerations(kinematics, udot, A_);
  S worst = S(0), size = S(0);
  for (int index : kinematics.mechanism().constraints()) {
    const Joint<Space, S>& joint = kinematics.mechanism().joints()[index];
    Components<Space, S> left = JointAcceleration<Space, S>(kinematics, index, A_);
    if (feedback.size() > 0) {
      left.head(joint.num_constraints()) += feedback.segment(joint.row, joint.num_constraints());
    }
    worst = std::max(worst, S(left.head(joint.num_constraints()).norm()));  // released ones follow
    size = std::max(
        {size, A_[joint.from].norm(), A_[joint.to].norm(), kinematics.joints()[index].g.norm()});
  }
  AppliedForces<Space, S>(kinematics, F_);
  S alone = S(0);
  for (int body = 1; body < kinematics.mechanism().num_bodies(); ++body) {
    const Inertia<Space, S>& inertia = kinematics.mechanism().bodies()[body];
    const auto inverse = kinematics.RotationalInverse(inertia, body);
    alone = std::max(
        {alone, (inverse * F_[body].angular).norm(), S(F_[body].linear.norm() / inertia.mass)});
  }
  if (worst <= S(kFollowed) * size + S(kRoundOff) * alone) return true;
  const S mismatch = RelativeMismatch(kinematics);
  return mismatch <= S(kMostDrift) && worst <= S(kOfMismatch) * mismatch * size;
}

/// Of joints that have come apart, accelerations are inconsistent by as much as their positions
/// are, or their speeds.
template <class Space, class S>
S Drives<Space, S>::RelativeMismatch(const Kinematics<Space, S>& kinematics) {
  const Mechanism<Space, S>& mechanism = kinematics.mechanism();
  S position = S(0), speed = S(0), size = S(0);
  for (int index : mechanism.constraints()) {
    const Velocity<Space, S> mismatch = kinematics.ConstraintMismatch(index);
    position = std::max(
        {position, mismatch.angular.norm(), S(mismatch.linear.norm() / mechanism.length())});
    speed = std::max(speed, kinematics.ConstraintSpeed(index).norm());
  }
  for (const Velocity<Space, S>& V : kinematics.motions()) size = std::max(size, V.norm());
  return position + (size > S(0) ? speed / size : S(0));
}

/// The directions of prescribed coordinates are columns H_k of the kind's motion map that stand in
/// D, and the drive's relative motion is H_k times its rate. A cut joint's drive carries the force
/// H_k lambda, whose power is lambda |H_k|^2 times the rate. For a tree joint, F_ is summed from
/// the leaves of the tree inwards and moved to Mo; the component of that along H_k is the drive's.
/// All in ground axes, wrenches of bodies at their centres of mass.
template <class Space, class S>
S Drives<Space, S>::Power(const Kinematics<Space, S>& kinematics, const VectorX<S>& udot,
                          const VectorX<S>& lambda) {
  const Mechanism<Space, S>& mechanism = kinematics.mechanism();
  S power = S(0);
  const auto rate = [&](const Joint<Space, S>& joint, int k) {
    return kinematics.drives()[joint.first_drive + k].rate;
  };
  std::ranges::copy(dynamics_.WrenchesLeft(kinematics, udot, lambda), F_.begin());
  for (int index : mechanism.constraints()) {
    const Joint<Space, S>& joint = mechanism.joints()[index];
    for (int k = 0; k < joint.num_drives; ++k) {
      power += lambda[joint.row + k] * rate(joint, k) / joint.kind->inverse_H_squared;
    }
  }
  for (auto step = mechanism.tree().rbegin(); step != mechanism.tree().rend(); ++step) {
    const Joint<Space, S>& joint = mechanism.joints()[step->joint];
    const JointState<Space, S>& state = kinematics.joints()[step->joint];
    const bool forward = step->sign > 0;
    const Linear<Space, S> to_joint = forward ? -state.r_Q : -state.r_P;
    const Wrench<Space, S> needed = ShiftForce<Space, S>(F_[step->child], to_joint);
    for (int k = 0; k < joint.num_drives; ++k) {
      power += S(step->sign) * state.D(k).dot(needed) * rate(joint, k);
    }
    F_[step->parent] += ShiftForce<Space, S>(needed, forward ? state.r_P : state.r_Q);
  }
  return power;
}

#define LOOPBENCH_INSTANTIATE(Space, S) template class Drives<Space, S>;
LOOPBENCH_FOR_EACH_SPACE_AND_MODEL_SCALAR(LOOPBENCH_INSTANTIATE)
#undef LOOPBENCH_INSTANTIATE

}  // namespace loopbench
