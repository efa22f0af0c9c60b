#include "odca/odca.h"

#include "mechanism/algebra/instantiate.h"

namespace loopbench::odca {

namespace {

PlanOptions DefaultPlan(SolverKind solver) {
  return {.grounding = solver == SolverKind::kAsPublished ? Grounding::kAtRoot : Grounding::kEager};
}

}  // namespace

template <class Space, class S>
Plan MakePlan(const Mechanism<Space, S>& mechanism, const PlanOptions& options) {
  std::vector<PlanJoint> joints;
  for (int j = 0; j < static_cast<int>(mechanism.joints().size()); ++j) {
    const Joint<Space, S>& joint = mechanism.joints()[j];
    const int rows = joint.num_constraints();
    if (rows > 0) joints.push_back({j, joint.from, joint.to, rows});
  }
  PlanOptions in_space = options;
  in_space.dim = Space::kDim;
  return Plan(mechanism.num_bodies(), joints, in_space);
}

template <class Space, class S>
Odca<Space, S>::Odca(const Mechanism<Space, S>& mechanism, FormulationOptions options)
    : Odca(mechanism, options, DefaultPlan(options.solver)) {}

template <class Space, class S>
Odca<Space, S>::Odca(const Mechanism<Space, S>& mechanism, FormulationOptions options,
                     const PlanOptions& plan)
    : Base(mechanism, options),
      plan_(MakePlan(mechanism, plan)),
      sweep_(mechanism, plan_, options.solver),
      wrenches_(mechanism.num_bodies(), Motion<Space, S>::Zero()),
      b_(wrenches_),
      A_(wrenches_),
      c0_(mechanism.joints().size(), Motion<Space, S>::Zero()),
      change_(VectorX<S>::Zero(mechanism.num_u())) {}

template <class Space, class S>
Outcome Odca<Space, S>::AssembleOnce() {
  if (assembled_version_ == kinematics_.position_version()) return Outcome::kFinished;
  const Outcome outcome = sweep_.Assemble(kinematics_);
  assembled_version_ = outcome == Outcome::kFinished ? kinematics_.position_version() : -1;
  diagnostics_.rank = Base::LoopRank(sweep_.joins().dependent_rows());
  diagnostics_.rcond = static_cast<double>(sweep_.joins().rcond());
  diagnostics_.smallest_weight = static_cast<double>(sweep_.joins().smallest_weight());
  diagnostics_.worst_joint = sweep_.joins().worst_joint();
  return outcome;
}

template <class Space, class S>
void Odca<Space, S>::TreeMotions(std::span<const Motion<Space, S>> A, VectorX<S>& result) const {
  for (const TreeStep& step : mechanism_.tree()) {
    const Joint<Space, S>& joint = mechanism_.joints()[step.joint];
    const JointState<Space, S>& state = kinematics_.joints()[step.joint];
    const Motion<Space, S> A_rel = ShiftMotion<Space, S>(A[joint.to], state.r_Q) -
                                   ShiftMotion<Space, S>(A[joint.from], state.r_P);
    for (int i = 0; i < state.num_u; ++i) {
      result[joint.u_offset + i] = joint.kind->per_speed * state.H(i).dot(A_rel);
    }
  }
}

/// Projection by impulses: the same sweep with b = 0 and the violation in place of c0.
template <class Space, class S>
Outcome Odca<Space, S>::CompleteSpeeds() {
  if (const Outcome outcome = AssembleOnce(); outcome != Outcome::kFinished) return outcome;
  kinematics_.UpdateVelocity(u_);
  for (Motion<Space, S>& b : b_) b.setZero();
  for (Motion<Space, S>& c0 : c0_) c0.setZero();
  for (int index : mechanism_.constraints()) {
    c0_[index] = kinematics_.ConstraintSpeed(index);
  }
  sweep_.Solve(b_, c0_, A_);
  TreeMotions(A_, change_);
  u_ += change_;
  return u_.allFinite() ? Outcome::kFinished : Outcome::kNonFinite;
}

template <class Space, class S>
Outcome Odca<Space, S>::Correct(const VectorX<S>& violation, VectorX<S>& change) {
  if (const Outcome outcome = AssembleOnce(); outcome != Outcome::kFinished) return outcome;
  for (Motion<Space, S>& b : b_) b.setZero();
  for (Motion<Space, S>& c0 : c0_) c0.setZero();
  for (int index : mechanism_.constraints()) {
    const Joint<Space, S>& joint = mechanism_.joints()[index];
    c0_[index].head(joint.num_constraints()) =
        violation.segment(joint.row, joint.num_constraints());
  }
  sweep_.Solve(b_, c0_, A_);
  TreeMotions(A_, change);
  return change.allFinite() ? Outcome::kFinished : Outcome::kNonFinite;
}

template <class Space, class S>
void Odca<Space, S>::SetFree(int body, const Motion<Space, S>& wrench) {
  const Inertia<Space, S>& inertia = mechanism_.bodies()[body];
  const Angular<Space, S> moment = wrench.template head<Space::kRot>();
  b_[body] << kinematics_.RotationalInverse(inertia, body) * moment,
      wrench.template tail<Space::kLin>() / inertia.mass;
}

/// A force along a tree joint is a pair of wrenches on its bodies.
template <class Space, class S>
void Odca<Space, S>::SolveConstrained(const VectorX<S>& force, const VectorX<S>& target,
                                      VectorX<S>& x, VectorX<S>& lambda) {
  for (Motion<Space, S>& wrench : wrenches_) wrench.setZero();
  for (Motion<Space, S>& c0 : c0_) c0.setZero();
  for (const TreeStep& step : mechanism_.tree()) {
    const Joint<Space, S>& joint = mechanism_.joints()[step.joint];
    const JointState<Space, S>& state = kinematics_.joints()[step.joint];
    Motion<Space, S> F = Motion<Space, S>::Zero();
    for (int i = 0; i < state.num_u; ++i) {
      F += state.H(i) * (joint.kind->per_speed * force[joint.u_offset + i]);
    }
    wrenches_[joint.to] += ShiftForce<Space, S>(F, state.r_Q);
    wrenches_[joint.from] -= ShiftForce<Space, S>(F, state.r_P);
  }
  for (int body = 1; body < mechanism_.num_bodies(); ++body) SetFree(body, wrenches_[body]);
  for (int index : mechanism_.constraints()) {
    const Joint<Space, S>& joint = mechanism_.joints()[index];
    c0_[index].head(joint.num_constraints()) = -target.segment(joint.row, joint.num_constraints());
  }
  sweep_.Solve(b_, c0_, A_);
  TreeMotions(A_, x);
  Multipliers(lambda);
}

template <class Space, class S>
Outcome Odca<Space, S>::Accelerations() {
  if (const Outcome outcome = AssembleOnce(); outcome != Outcome::kFinished) return outcome;
  AppliedForces<Space, S>(kinematics_, wrenches_);
  for (int body = 1; body < mechanism_.num_bodies(); ++body) {
    const Inertia<Space, S>& inertia = mechanism_.bodies()[body];
    const Angular<Space, S> w = kinematics_.motions()[body].template head<Space::kRot>();
    const Angular<Space, S> Iw = kinematics_.RotationalInertia(inertia, body) * w;
    wrenches_[body].template head<Space::kRot>() -= CrossAngular<S>(w, Iw);
    SetFree(body, wrenches_[body]);
  }
  // c0 = D^T (n_Q - n_P - g); the same difference is needed along H below            (7)
  for (std::size_t j = 0; j < c0_.size(); ++j) {
    const Joint<Space, S>& joint = mechanism_.joints()[j];
    const JointState<Space, S>& state = kinematics_.joints()[j];
    const Motion<Space, S> known = kinematics_.Centripetal(joint.to, state.r_Q) -
                                   kinematics_.Centripetal(joint.from, state.r_P) - state.g;
    for (int i = 0; i < state.rows(); ++i) c0_[j][i] = state.D(i).dot(known);
    for (int i = 0; i < (joint.in_tree() ? state.num_u : 0); ++i) {
      change_[joint.u_offset + i] = joint.kind->per_speed * state.H(i).dot(known);
    }
  }
  if (Base::feedback().size() > 0) {
    for (int index : mechanism_.constraints()) {
      const Joint<Space, S>& joint = mechanism_.joints()[index];
      c0_[index].head(joint.num_constraints()) +=
          Base::feedback().segment(joint.row, joint.num_constraints());
    }
  }
  sweep_.Solve(b_, c0_, A_);
  TreeMotions(A_, udot_);
  udot_ += change_;
  return udot_.allFinite() ? Outcome::kFinished : Outcome::kNonFinite;
}

template <class Space, class S>
void Odca<Space, S>::Multipliers(VectorX<S>& lambda) {
  for (int index : mechanism_.constraints()) {
    const Joint<Space, S>& joint = mechanism_.joints()[index];
    lambda.segment(joint.row, joint.num_constraints()) =
        sweep_.multipliers()[index].head(joint.num_constraints());
  }
}

template <class Space, class S>
Motion<Space, S> Odca<Space, S>::JointForce(int joint) const {
  const JointState<Space, S>& state = kinematics_.joints()[joint];
  Motion<Space, S> force = Motion<Space, S>::Zero();
  for (int i = 0; i < state.rows(); ++i) force += state.D(i) * sweep_.multipliers()[joint][i];
  return force;
}

#define LOOPBENCH_INSTANTIATE(Space, S) template class Odca<Space, S>;
LOOPBENCH_FOR_EACH_SPACE_AND_SCALAR(LOOPBENCH_INSTANTIATE)
#undef LOOPBENCH_INSTANTIATE

#define LOOPBENCH_INSTANTIATE(Space, S) \
  template Plan MakePlan(const Mechanism<Space, S>&, const PlanOptions&);
LOOPBENCH_FOR_EACH_SPACE_AND_SCALAR(LOOPBENCH_INSTANTIATE)
#undef LOOPBENCH_INSTANTIATE

}  // namespace loopbench::odca
