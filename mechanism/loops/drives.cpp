#include "mechanism/loops/drives.h"

#include <algorithm>
#include <cmath>

#include "mechanism/algebra/instantiate.h"

namespace loopbench {

template <class Space, class S>
Drives<Space, S>::Drives(const Mechanism<Space, S>& mechanism)
    : dynamics_(mechanism),
      A_(mechanism.num_bodies(), Acceleration<Space, S>::Zero()),
      F_(mechanism.num_bodies(), Wrench<Space, S>::Zero()),
      missed_(mechanism.joints().size(), S(0)) {}

// a scalar's own maximum, where it has one, is no branch of the text
using std::max;

namespace {

/// Largest part of a motion, in turns [rad] and mechanism lengths.
template <class Space, class S, class Motion>
S SizeOf(const Kinematics<Space, S>& kinematics, const Motion& A) {
  return max(S(A.angular.norm()), S(A.linear.norm() / kinematics.mechanism().length()));
}

/// Size of a mismatch of a coupling or of its rates, in the same units.
template <class Space, class S>
S SizeOfCoupling(const Kinematics<Space, S>& kinematics, int coupling, const S& mismatch) {
  using std::abs;
  const S size = abs(kinematics.OfFirstJoint(coupling, mismatch));
  return kinematics.FirstTurns(coupling) ? size : S(size / kinematics.mechanism().length());
}

/// Speed of the fastest body.
template <class Space, class S>
S SpeedOf(const Kinematics<Space, S>& kinematics) {
  S speed = S(0);
  for (const Velocity<Space, S>& V : kinematics.motions()) {
    speed = max(speed, SizeOf(kinematics, V));
  }
  return speed;
}

}  // namespace

/// (7) at Mo of a joint is the sum of A_Q, A_P, their centripetal parts and g. `left` is D^T of it
/// for the accelerations that udot gives the bodies. `alone` is M^-1 times each body's wrench at
/// its centre of mass.
template <class Space, class S>
bool Drives<Space, S>::Followed(const Kinematics<Space, S>& kinematics, const VectorX<S>& udot,
                                const VectorX<S>& feedback) {
  const Mechanism<Space, S>& mechanism = kinematics.mechanism();
  dynamics_.BodyAccelerations(kinematics, udot, A_);
  acceleration_ = worst_ = S(0);
  for (const Acceleration<Space, S>& A : A_) {
    acceleration_ = max(acceleration_, SizeOf(kinematics, A));
  }
  size_ = acceleration_;
  for (std::size_t j = 0; j < mechanism.joints().size(); ++j) {
    const Joint<Space, S>& joint = mechanism.joints()[j];
    const JointState<Space, S>& state = kinematics.joints()[j];
    for (const S& part : {SizeOf(kinematics, state.g),
                          SizeOf(kinematics, kinematics.Centripetal(joint.from, state.r_P)),
                          SizeOf(kinematics, kinematics.Centripetal(joint.to, state.r_Q))}) {
      size_ = max(size_, part);
    }
  }
  std::ranges::fill(missed_, S(0));
  for (int index : mechanism.constraints()) {
    const Joint<Space, S>& joint = mechanism.joints()[index];
    const JointState<Space, S>& state = kinematics.joints()[index];
    Components<Space, S> left = JointAcceleration<Space, S>(kinematics, index, A_);
    if (feedback.size() > 0) {
      left.head(state.rows()) += feedback.segment(joint.row, state.rows());
    }
    missed_[index] = SizeOf(kinematics, state.Sum(left, state.rows()));  // released ones follow
    worst_ = max(worst_, missed_[index]);
  }
  for (int c = 0; c < static_cast<int>(mechanism.couplings().size()); ++c) {
    const int first = kinematics.FirstOf(c).joint, row = mechanism.num_rows() + c;
    S left = CouplingAcceleration<Space, S>(kinematics, c, &udot, A_);
    if (feedback.size() > row) left += feedback[row];
    missed_[first] = max(missed_[first], SizeOfCoupling(kinematics, c, left));
    worst_ = max(worst_, missed_[first]);
  }
  AppliedForces<Space, S>(kinematics, F_);
  S alone = S(0);
  for (int body = 1; body < mechanism.num_bodies(); ++body) {
    const Inertia<Space, S>& inertia = mechanism.bodies()[body];
    const Acceleration<Space, S> A(kinematics.RotationalInverse(inertia, body) * F_[body].angular,
                                   F_[body].linear / inertia.mass);
    alone = max(alone, SizeOf(kinematics, A));
  }
  fastest_ = max(fastest_, SpeedOf(kinematics));
  return worst_ <= S(kFollowed) * size_ + S(kRoundOff) * alone || IsDrift(kinematics);
}

/// At the speed v a width x takes x / v, in which an acceleration a adds up to a (x / v)^2 / 2.
template <class Space, class S>
bool Drives<Space, S>::DecidesBranch(const Kinematics<Space, S>& kinematics) const {
  const S speed = SpeedOf(kinematics);
  const double x = std::sqrt(DirectionWeights<double>::kTheta);
  return worst_ <= S(kLeftOnBranch) * size_ &&
         S(x / 2) * acceleration_ <= S(kTurned) * speed * speed;
}

template <class Space, class S>
bool Drives<Space, S>::NoteRank(int rank) {
  const bool has_grown = usual_rank_ > 0 && rank > usual_rank_;
  usual_rank_ = std::max(usual_rank_, rank);
  return has_grown;
}

/// Accelerations of joints with drift are inconsistent by their position violation, or by the
/// products of speeds with the velocity violation. If a driver rests, that is the size of the
/// speeds themselves, and small next to the others.
template <class Space, class S>
bool Drives<Space, S>::IsDrift(const Kinematics<Space, S>& kinematics) {
  S position = S(0), missed = S(0);
  for (int index : kinematics.mechanism().constraints()) {
    const JointState<Space, S>& state = kinematics.joints()[index];
    position = max(position, SizeOf(kinematics, kinematics.ConstraintMismatch(index)));
    missed =
        max(missed, SizeOf(kinematics, state.Sum(kinematics.ConstraintSpeed(index), state.rows())));
  }
  for (int c = 0; c < static_cast<int>(kinematics.mechanism().couplings().size()); ++c) {
    position = max(position, SizeOfCoupling(kinematics, c, kinematics.CouplingMismatch(c)));
    missed = max(missed, SizeOfCoupling(kinematics, c, kinematics.CouplingSpeed(c)));
  }
  return position * fastest_ + missed <= S(kMaxDrift) * fastest_ &&
         worst_ <= S(kOfMismatch) * (position * size_ + missed * SpeedOf(kinematics));
}

/// The directions of prescribed coordinates are columns H_k of the kind's motion map placed in D,
/// and the driver's relative motion is H_k times its rate. A cut joint's driver carries the force
/// H_k lambda, whose power is lambda |H_k|^2 times the rate. For a tree joint, F_ is summed from
/// the leaves of the tree inwards and moved to Mo; its component along H_k is the driver's. All in
/// ground axes, wrenches of bodies at their centres of mass.
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
