#include "mechanism/loops/body_equations.h"

#include <algorithm>

#include "mechanism/algebra/instantiate.h"

namespace loopbench {

template <class Space, class S>
BodyEquations<Space, S>::BodyEquations(const Mechanism<Space, S>& mechanism)
    : mechanism_(mechanism),
      wrenches_(mechanism.num_bodies(), Wrench<Space, S>::Zero()),
      b_(mechanism.num_bodies(), Acceleration<Space, S>::Zero()),
      A_(b_),
      last_(b_),
      c0_(mechanism.joints().size(), Components<Space, S>::Zero()),
      known_(mechanism.joints().size(), Acceleration<Space, S>::Zero()),
      lambda_change_(VectorX<S>::Zero(mechanism.num_rows())),
      known_x_(VectorX<S>::Zero(mechanism.num_u())) {}

/// b = M^-1 times the wrench, at the centre of mass in ground axes: the part of the paper's zeta_i3
/// that is the same at both handles, before its shift. Moments, less w x I w, are taken to axes of
/// the body, where the inertia is constant.
template <class Space, class S>
void BodyEquations<Space, S>::SetFree(const Kinematics<Space, S>& kinematics, bool turning) {
  has_force_ = true;
  for (int body = 1; body < mechanism_.num_bodies(); ++body) {
    const Inertia<Space, S>& inertia = mechanism_.bodies()[body];
    Angular<Space, S> alpha = inertia.rotational_inverse * wrenches_[body].angular;
    if constexpr (Space::kRot == 3) {
      const Rotation<Space, S>& R = kinematics.poses()[body].R;
      Angular<Space, S> moment = R.transpose() * wrenches_[body].angular;
      if (turning) {
        const Angular<Space, S> w = R.transpose() * kinematics.motions()[body].angular;
        moment -= CrossAngular<S>(w, inertia.rotational * w);
        wrenches_[body].angular = R * moment;
      }
      alpha = R * (inertia.rotational_inverse * moment);
    }
    b_[body] = {alpha, wrenches_[body].linear / inertia.mass};
  }
}

template <class Space, class S>
void BodyEquations<Space, S>::SetTarget(const VectorX<S>& target) {
  has_force_ = has_speeds_ = false;
  for (Components<Space, S>& c0 : c0_) c0.setZero();
  for (int index : mechanism_.constraints()) {
    const Joint<Space, S>& joint = mechanism_.joints()[index];
    for (int k = 0; k < joint.num_constraints(); ++k) c0_[index][k] = -target[joint.row + k];
  }
}

template <class Space, class S>
void BodyEquations<Space, S>::SetForce(const Kinematics<Space, S>& kinematics,
                                       const VectorX<S>& force, const VectorX<S>& target) {
  known_x_.setZero();
  SetTarget(target);
  has_force_ = force.size() > 0;
  if (!has_force_) return;
  for (Wrench<Space, S>& wrench : wrenches_) wrench.setZero();
  for (const TreeStep& step : mechanism_.tree()) {
    const Joint<Space, S>& joint = mechanism_.joints()[step.joint];
    const JointState<Space, S>& state = kinematics.joints()[step.joint];
    auto F = Wrench<Space, S>::Zero();
    for (int i = 0; i < state.num_u; ++i) {
      F += WrenchOfEffort<Space, S>(state.H(i), joint.kind->inverse_H_squared,
                                    force[joint.u_offset + i]);
    }
    wrenches_[joint.to] += ShiftForce<Space, S>(F, state.r_Q);
    wrenches_[joint.from] -= ShiftForce<Space, S>(F, state.r_P);
  }
  SetFree(kinematics, false);
}

template <class Space, class S>
void BodyEquations<Space, S>::SetWrenches(const Kinematics<Space, S>& kinematics,
                                          const VectorX<S>& wrenches) {
  known_x_.setZero();
  has_speeds_ = false;
  for (Components<Space, S>& c0 : c0_) c0.setZero();
  for (std::size_t body = 0; body < wrenches_.size(); ++body) {
    for (int d = 0; d < Space::kDim; ++d) {
      wrenches_[body][d] = wrenches[static_cast<Eigen::Index>(body) * Space::kDim + d];
    }
  }
  SetFree(kinematics, false);
}

/// n_Q - n_P - g is the part of (7) besides the accelerations at centres of mass and H udot, at Mo
/// in ground axes. Its components along D are c0, to which feedback adds; components along H belong
/// to udot.
template <class Space, class S>
void BodyEquations<Space, S>::SetState(const Kinematics<Space, S>& kinematics,
                                       const VectorX<S>& feedback) {
  AppliedForces<Space, S>(kinematics, wrenches_);
  SetFree(kinematics, true);
  has_speeds_ = true;
  for (std::size_t j = 0; j < c0_.size(); ++j) {
    const Joint<Space, S>& joint = mechanism_.joints()[j];
    const JointState<Space, S>& state = kinematics.joints()[j];
    Acceleration<Space, S>& known = known_[j];
    known = kinematics.Centripetal(joint.to, state.r_Q) -
            kinematics.Centripetal(joint.from, state.r_P) - state.g;
    c0_[j] = state.Along(known, state.rows());
    for (int i = 0; i < (joint.in_tree() ? state.num_u : 0); ++i) {
      known_x_[joint.u_offset + i] = joint.kind->inverse_H_squared * state.H(i).dot(known);
    }
  }
  if (feedback.size() == 0) return;
  for (int index : mechanism_.constraints()) {
    const Joint<Space, S>& joint = mechanism_.joints()[index];
    c0_[index].head(joint.num_constraints()) +=
        feedback.segment(joint.row, joint.num_constraints());
  }
}

template <class Space, class S>
void BodyEquations<Space, S>::SetMissed(const Kinematics<Space, S>& kinematics) {
  known_x_.setZero();
  has_speeds_ = false;
  has_force_ = false;
  for (Components<Space, S>& c0 : c0_) c0.setZero();
  for (int index : mechanism_.constraints()) c0_[index] = kinematics.ConstraintSpeed(index);
}

/// x = H^T (A_Q - A_P) / |H|^2 of each tree joint, both points at Mo: udot of (7).
template <class Space, class S>
void BodyEquations<Space, S>::Read(const Kinematics<Space, S>& kinematics, VectorX<S>& x) const {
  x = known_x_;
  for (const TreeStep& step : mechanism_.tree()) {
    const Joint<Space, S>& joint = mechanism_.joints()[step.joint];
    const JointState<Space, S>& state = kinematics.joints()[step.joint];
    const Acceleration<Space, S> A_rel = ShiftMotion<Space, S>(A_[joint.to], state.r_Q) -
                                         ShiftMotion<Space, S>(A_[joint.from], state.r_P);
    for (int i = 0; i < state.num_u; ++i) {
      x[joint.u_offset + i] += joint.kind->inverse_H_squared * state.H(i).dot(A_rel);
    }
  }
}

template <class Space, class S>
void BodyEquations<Space, S>::Read(std::span<const Components<Space, S>> phi,
                                   VectorX<S>& lambda) const {
  for (int index : mechanism_.constraints()) {
    const Joint<Space, S>& joint = mechanism_.joints()[index];
    lambda.segment(joint.row, joint.num_constraints()) = phi[index].head(joint.num_constraints());
  }
}

#define LOOPBENCH_INSTANTIATE(Space, S) template class BodyEquations<Space, S>;
LOOPBENCH_FOR_EACH_SPACE_AND_SCALAR(LOOPBENCH_INSTANTIATE)
#undef LOOPBENCH_INSTANTIATE

}  // namespace loopbench
