#include "odca/odca.h"

#include <algorithm>
#include <type_traits>

#include "mechanism/algebra/instantiate.h"
#include "odca/path_sweep.h"

namespace loopbench::odca {

namespace {

PlanOptions DefaultPlan(SolverKind solver) {
  return {.grounding = solver == SolverKind::kAsPublished ? Grounding::kAtRoot : Grounding::kEager};
}

}  // namespace

template <class Space, class S>
std::vector<PlanJoint> PlanJoints(const Mechanism<Space, S>& mechanism) {
  std::vector<PlanJoint> joints;
  for (int j = 0; j < static_cast<int>(mechanism.joints().size()); ++j) {
    const Joint<Space, S>& joint = mechanism.joints()[j];
    const int rows = joint.num_constraints();
    if (rows > 0) joints.push_back({j, joint.from, joint.to, rows});
  }
  return joints;
}

template <class Space, class S>
Plan MakePlan(const Mechanism<Space, S>& mechanism, const PlanOptions& options) {
  PlanOptions in_space = options;
  in_space.dim = Space::kDim;
  return Plan(mechanism.num_bodies(), PlanJoints(mechanism), in_space);
}

template <class Space, class S>
Odca<Space, S>::Odca(const Mechanism<Space, S>& mechanism, const FormulationOptions& options)
    : Odca(mechanism, options, DefaultPlan(options.solver)) {}

template <class Space, class S>
Odca<Space, S>::Odca(const Mechanism<Space, S>& mechanism, const FormulationOptions& options,
                     const PlanOptions& plan)
    : mechanism_(mechanism),
      plan_(MakePlan(mechanism, plan)),
      sweep_(mechanism, plan_, options.solver),
      wrenches_(mechanism.num_bodies(), Wrench<Space, S>::Zero()),
      b_(mechanism.num_bodies(), Acceleration<Space, S>::Zero()),
      A_(b_),
      c0_(mechanism.joints().size(), Components<Space, S>::Zero()),
      known_(VectorX<S>::Zero(mechanism.num_u())),
      change_(known_) {
  if constexpr (std::is_same_v<Space, Planar> && std::is_same_v<S, double>) {
    if (options.solver == SolverKind::kRankRevealing) paths_ = pins::PathSweep::Make(mechanism);
  }
}

template <class Space, class S>
Odca<Space, S>::~Odca() = default;

template <class Space, class S>
Outcome Odca<Space, S>::Factor(const Kinematics<Space, S>& kinematics) {
  kinematics_ = &kinematics;
  by_paths_ = false;
  const Outcome outcome = sweep_.Assemble(kinematics);
  const Joins<Space, S>& joins = sweep_.joins();
  this->conditioning_ = {.rank = LoopRank(mechanism_, joins.dependent_rows()),
                         .rcond = static_cast<double>(joins.rcond()),
                         .smallest_weight = static_cast<double>(joins.smallest_weight()),
                         .worst_joint = joins.worst_joint()};
  return outcome;
}

/// The sweep, then x = H^T (A_Q - A_P) / |H|^2 of each tree joint, both points at Mo: udot of (7),
/// but for what SetKnown() has noted. lambda is phi along the D of cut joints.
template <class Space, class S>
void Odca<Space, S>::SweepTo(VectorX<S>& x, VectorX<S>* lambda) {
  sweep_.Solve(b_, c0_, A_);
  for (const TreeStep& step : mechanism_.tree()) {
    const Joint<Space, S>& joint = mechanism_.joints()[step.joint];
    const JointState<Space, S>& state = kinematics_->joints()[step.joint];
    const Acceleration<Space, S> A_rel = ShiftMotion<Space, S>(A_[joint.to], state.r_Q) -
                                         ShiftMotion<Space, S>(A_[joint.from], state.r_P);
    for (int i = 0; i < state.num_u; ++i) {
      x[joint.u_offset + i] = joint.kind->inverse_H_squared * state.H(i).dot(A_rel);
    }
  }
  if (lambda == nullptr) return;
  for (int index : mechanism_.constraints()) {
    const Joint<Space, S>& joint = mechanism_.joints()[index];
    lambda->segment(joint.row, joint.num_constraints()) =
        sweep_.multipliers()[index].head(joint.num_constraints());
  }
}

/// b = M^-1 times the wrench, at the centre of mass in ground axes: the part of the paper's zeta_i3
/// that is the same at both handles, before its shift.
template <class Space, class S>
void Odca<Space, S>::SetFree() {
  for (int body = 1; body < mechanism_.num_bodies(); ++body) {
    const Inertia<Space, S>& inertia = mechanism_.bodies()[body];
    b_[body] = {kinematics_->RotationalInverse(inertia, body) * wrenches_[body].angular,
                wrenches_[body].linear / inertia.mass};
  }
}

template <class Space, class S>
void Odca<Space, S>::Solve(const VectorX<S>& force, const VectorX<S>& target, VectorX<S>& x,
                           VectorX<S>* lambda) {
  for (Components<Space, S>& c0 : c0_) c0.setZero();
  for (int index : mechanism_.constraints()) {
    const Joint<Space, S>& joint = mechanism_.joints()[index];
    c0_[index].head(joint.num_constraints()) = -target.segment(joint.row, joint.num_constraints());
  }
  if (force.size() == 0) {
    for (Acceleration<Space, S>& b : b_) b.setZero();
    SweepTo(x, lambda);
    return;
  }
  for (Wrench<Space, S>& wrench : wrenches_) wrench.setZero();
  for (const TreeStep& step : mechanism_.tree()) {
    const Joint<Space, S>& joint = mechanism_.joints()[step.joint];
    const JointState<Space, S>& state = kinematics_->joints()[step.joint];
    auto F = Wrench<Space, S>::Zero();
    for (int i = 0; i < state.num_u; ++i) {
      F += state.H(i) * (joint.kind->inverse_H_squared * force[joint.u_offset + i]);
    }
    wrenches_[joint.to] += ShiftForce<Space, S>(F, state.r_Q);
    wrenches_[joint.from] -= ShiftForce<Space, S>(F, state.r_P);
  }
  SetFree();
  SweepTo(x, lambda);
}

/// n_Q - n_P - g is what (7) has beside the accelerations at centres of mass and H udot, at Mo in
/// ground axes. Its components along D are c0, those along H belong to udot.
template <class Space, class S>
void Odca<Space, S>::SetKnown(const Kinematics<Space, S>& kinematics) {
  for (std::size_t j = 0; j < c0_.size(); ++j) {
    const Joint<Space, S>& joint = mechanism_.joints()[j];
    const JointState<Space, S>& state = kinematics.joints()[j];
    const Acceleration<Space, S> known = kinematics.Centripetal(joint.to, state.r_Q) -
                                         kinematics.Centripetal(joint.from, state.r_P) - state.g;
    c0_[j] = state.Along(known, state.rows());
    for (int i = 0; i < (joint.in_tree() ? state.num_u : 0); ++i) {
      known_[joint.u_offset + i] = joint.kind->inverse_H_squared * state.H(i).dot(known);
    }
  }
}

/// The wrench of applied forces less w x I w makes b. Feedback is a part of c0.
template <class Space, class S>
bool Odca<Space, S>::Accelerate(const Kinematics<Space, S>& kinematics, const VectorX<S>& feedback,
                                VectorX<S>& udot, VectorX<S>* lambda) {
  AppliedForces<Space, S>(kinematics, wrenches_);
  for (int body = 1; body < mechanism_.num_bodies(); ++body) {
    const Inertia<Space, S>& inertia = mechanism_.bodies()[body];
    const Angular<Space, S>& w = kinematics.motions()[body].angular;
    wrenches_[body].angular -= CrossAngular<S>(w, kinematics.RotationalInertia(inertia, body) * w);
  }
  SetFree();
  SetKnown(kinematics);
  for (int index : mechanism_.constraints()) {
    if (feedback.size() == 0) break;
    const Joint<Space, S>& joint = mechanism_.joints()[index];
    c0_[index].head(joint.num_constraints()) +=
        feedback.segment(joint.row, joint.num_constraints());
  }
  SweepTo(udot, lambda);
  udot += known_;
  return true;
}

template <class Space, class S>
bool Odca<Space, S>::RightHandSide([[maybe_unused]] SpeedsUsed speeds,
                                   [[maybe_unused]] std::span<const S> q,
                                   [[maybe_unused]] std::span<const S> u,
                                   [[maybe_unused]] std::span<S> qdot,
                                   [[maybe_unused]] std::span<S> udot) {
  if constexpr (std::is_same_v<Space, Planar> && std::is_same_v<S, double>) {
    by_paths_ = paths_ != nullptr && paths_->Evaluate(speeds, q, u, qdot, udot);
    return by_paths_;
  }
  return false;
}

/// What the speeds miss, joint by joint: no vector of rows is needed between.
template <class Space, class S>
bool Odca<Space, S>::CompleteSpeeds(Kinematics<Space, S>& kinematics, VectorX<S>& u) {
  kinematics.UpdateVelocity(u);
  for (Acceleration<Space, S>& b : b_) b.setZero();
  for (Components<Space, S>& c0 : c0_) c0.setZero();
  for (int index : mechanism_.constraints()) c0_[index] = kinematics.ConstraintSpeed(index);
  SweepTo(change_, nullptr);
  u += change_;
  return true;
}

template <class Space, class S>
std::vector<NamedCount> Odca<Space, S>::Counters() const {
  return {{"plan_depth", plan_.depth()},
          {"plan_largest_join", plan_.largest_join()},
          {"rhs_operations", by_paths_ ? paths_->operations() : sweep_.operations()}};
}

template <class Space, class S>
Wrench<Space, S> Odca<Space, S>::JointForce(int joint) const {
  if (kinematics_ == nullptr) return Wrench<Space, S>::Zero();
  const JointState<Space, S>& state = kinematics_->joints()[joint];
  return state.Sum(sweep_.multipliers()[joint], state.rows());  // (13)
}

#define LOOPBENCH_INSTANTIATE(Space, S) template class Odca<Space, S>;
LOOPBENCH_FOR_EACH_SPACE_AND_SCALAR(LOOPBENCH_INSTANTIATE)
#undef LOOPBENCH_INSTANTIATE

#define LOOPBENCH_INSTANTIATE(Space, S)                                   \
  template std::vector<PlanJoint> PlanJoints(const Mechanism<Space, S>&); \
  template Plan MakePlan(const Mechanism<Space, S>&, const PlanOptions&);
LOOPBENCH_FOR_EACH_SPACE_AND_SCALAR(LOOPBENCH_INSTANTIATE)
#undef LOOPBENCH_INSTANTIATE

}  // namespace loopbench::odca
