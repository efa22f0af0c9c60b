#include "mechanism/formulation/factored_state.h"

#include <algorithm>

#include "mechanism/algebra/instantiate.h"

namespace loopbench {

template <class Space, class S>
Outcome FactoredState<Space, S>::Factor() {
  if (factored_version_ == kinematics_.position_version()) return Outcome::kFinished;
  const Outcome outcome = solver_.Factor(kinematics_);
  factored_version_ = outcome == Outcome::kFinished ? kinematics_.position_version() : -1;
  return outcome;
}

template <class Space, class S>
Outcome FactoredState<Space, S>::Correct(const VectorX<S>& violation, VectorX<S>& change) {
  if (const Outcome outcome = Factor(); outcome != Outcome::kFinished) return outcome;
  target_ = -violation;
  solver_.Correct(target_, change);
  return change.allFinite() ? Outcome::kFinished : Outcome::kNonFinite;
}

template <class Space, class S>
void FactoredState<Space, S>::SetPositions(const Eigen::Ref<const VectorX<S>>& q) {
  const bool changed = stress_ != nullptr && kinematics_.released() != released_;
  if (changed) kinematics_.Release(released_);
  kinematics_.UpdatePosition(q);
  if (stress() == nullptr || stress_->Factor(kinematics_)) return;
  kinematics_.Release(stress_->Choose(kinematics_));
  const VectorX<S> here = kinematics_.q();
  kinematics_.UpdatePosition(here);
  stress_->Factor(kinematics_);
}

template <class Space, class S>
bool FactoredState<Space, S>::AcceptReleased() {
  const bool is_rounded = stress() == nullptr;
  if (stress_ == nullptr || (is_rounded && stress_->Factor(kinematics_))) return false;
  released_ = stress_->Choose(kinematics_);
  if (kinematics_.released() == released_) return false;
  const VectorX<S> q = kinematics_.q(), u = kinematics_.u();
  SetPositions(q);
  SetSpeeds(u);
  return is_rounded;
}

template <class Space, class S>
void FactoredState<Space, S>::ShareSpeeds(VectorX<S>& u) {
  if (stress() == nullptr || stress_->is_exact()) return;
  SetSpeeds(u);
  solver_.Correct(stress_->ShareOfSpeeds(kinematics_), change_);
  u += change_;
}

template <class Space, class S>
void PositionViolation(const Kinematics<Space, S>& kinematics, VectorX<S>& violation,
                       Correction<S>& largest) {
  using std::abs;
  using std::max;
  const Mechanism<Space, S>& mechanism = kinematics.mechanism();
  violation.resize(mechanism.num_equations());
  largest.shift = largest.rotation = S(0);
  for (int index : kinematics.mechanism().constraints()) {
    const Joint<Space, S>& joint = kinematics.mechanism().joints()[index];
    const JointState<Space, S>& state = kinematics.joints()[index];
    const Velocity<Space, S> mismatch = kinematics.ConstraintMismatch(index);
    violation.segment(joint.row, state.rows()) =
        state.Along(mismatch, state.rows()).head(state.rows());
    const Direction<Space, S> constrained = kinematics.Constrained(index, mismatch);
    largest.rotation = max(largest.rotation, constrained.angular.norm());
    largest.shift = max(largest.shift, constrained.linear.norm());
  }
  for (int c = 0; c < static_cast<int>(mechanism.couplings().size()); ++c) {
    const S mismatch = kinematics.CouplingMismatch(c);
    violation[mechanism.num_rows() + c] = mismatch;
    S& same = kinematics.FirstTurns(c) ? largest.rotation : largest.shift;
    same = max(same, S(abs(kinematics.OfFirstJoint(c, mismatch))));
  }
}

template <class Space, class S>
void SpeedViolation(const Kinematics<Space, S>& kinematics, VectorX<S>& violation) {
  const Mechanism<Space, S>& mechanism = kinematics.mechanism();
  violation.resize(mechanism.num_equations());
  for (int c = 0; c < static_cast<int>(mechanism.couplings().size()); ++c) {
    violation[mechanism.num_rows() + c] = kinematics.CouplingSpeed(c);
  }
  for (int index : kinematics.mechanism().constraints()) {
    const Joint<Space, S>& joint = kinematics.mechanism().joints()[index];
    violation.segment(joint.row, joint.num_constraints()) =
        kinematics.ConstraintSpeed(index).head(joint.num_constraints());
  }
}

#define LOOPBENCH_INSTANTIATE(Space, S)                                                      \
  template class FactoredState<Space, S>;                                                    \
  template void PositionViolation(const Kinematics<Space, S>&, VectorX<S>&, Correction<S>&); \
  template void SpeedViolation(const Kinematics<Space, S>&, VectorX<S>&);
LOOPBENCH_FOR_EACH_SPACE_AND_SCALAR(LOOPBENCH_INSTANTIATE)
#undef LOOPBENCH_INSTANTIATE

}  // namespace loopbench
