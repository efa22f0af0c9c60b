#include "odca/odca.h"

#include <algorithm>

#include "mechanism/algebra/instantiate.h"
#include "mechanism/loops/self_stress.h"

namespace loopbench::odca {

template <class Space, class S>
std::vector<PlanJoint> PlanJoints(const Mechanism<Space, S>& mechanism) {
  std::vector<PlanJoint> joints;
  for (int j = 0; j < static_cast<int>(mechanism.joints().size()); ++j) {
    const Joint<Space, S>& joint = mechanism.joints()[j];
    const int rows = joint.num_constraints();
    // Not orthogonal: exact tilts (JointKind::exact_basis) to each other, exact directions of
    // screws to H, imposed rows that include released ones. Prescribed motions that contradict a
    // loop are detected in the equations of this loop, so their joints hold no body.
    const bool releases = joint.num_released > 0, tilts = joint.kind->basis_rate != nullptr;
    const bool is_orthogonal =
        tilts ? !releases && !joint.kind->has_screws : !releases || !mechanism.is_redundant();
    const bool may_hold = joint.num_drives == 0 && (joint.in_tree() || is_orthogonal);
    if (rows > 0) joints.push_back({j, joint.from, joint.to, rows, may_hold});
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
Odca<Space, S>::Odca(const Mechanism<Space, S>& mechanism, const FormulationOptions& options,
                     const std::optional<PlanOptions>& plan)
    : mechanism_(mechanism),
      plan_(MakePlan(mechanism, plan.value_or(PlanOptionsOf(options.solver)))),
      sweep_(mechanism, plan_, options.solver, options.threads),
      equations_(mechanism),
      change_(VectorX<S>::Zero(mechanism.num_u())) {
  if (options.solver != SolverKind::kRankRevealing || options.general) return;
  if constexpr (!std::is_same_v<S, double>) {
    return;
  } else if constexpr (std::is_same_v<Space, Spatial>) {
    short_cut_ = arms::MakeArmSweep(mechanism, options.threads);
  } else if (auto path = pins::MakePathSweep(mechanism, options.threads)) {
    if (options.beside != nullptr) lane_ = pins::PathLane::Take(*options.beside, *path);
    short_cut_ = std::move(path);
  } else {
    short_cut_ = pins::MakeAssemblySweep(mechanism, plan_, options.threads);
  }
}

template <class Space, class S>
Outcome Odca<Space, S>::Factor(const Kinematics<Space, S>& kinematics) {
  kinematics_ = &kinematics;
  by_short_cut_ = false;
  const Outcome outcome = sweep_.Assemble(kinematics);
  this->conditioning_ = {.rank = LoopRank(mechanism_, sweep_.dependent_rows()),
                         .rcond = static_cast<double>(sweep_.rcond()),
                         .smallest_weight = static_cast<double>(sweep_.smallest_weight()),
                         .is_regularized = sweep_.smallest_weight() < S(1),
                         .worst_joint = sweep_.worst_joint()};
  return outcome;
}

template <class Space, class S>
void Odca<Space, S>::SolveEquations() {
  sweep_.Solve({.b = equations_.b(),
                .wrenches = equations_.wrenches(),
                .c0 = equations_.c0(),
                .known = equations_.known()},
               equations_.A());
}

template <class Space, class S>
void Odca<Space, S>::SweepTo(VectorX<S>& x, VectorX<S>* lambda) {
  SolveEquations();
  equations_.Read(*kinematics_, x);
  if (lambda != nullptr) equations_.Read(sweep_.multipliers(), *lambda);
}

template <class Space, class S>
void Odca<Space, S>::Solve(const VectorX<S>& force, const VectorX<S>& target, VectorX<S>& x,
                           VectorX<S>* lambda) {
  equations_.SetForce(*kinematics_, force, target);
  SweepTo(x, lambda);
}

template <class Space, class S>
void Odca<Space, S>::SolveWrenches(const VectorX<S>& wrenches, VectorX<S>& x, VectorX<S>* lambda) {
  equations_.SetWrenches(*kinematics_, wrenches);
  SweepTo(x, lambda);
}

template <class Space, class S>
bool Odca<Space, S>::Accelerate(const Kinematics<Space, S>& kinematics, const VectorX<S>& feedback,
                                VectorX<S>& udot, VectorX<S>* lambda) {
  equations_.SetState(kinematics, feedback);
  SweepTo(udot, lambda);
  return true;
}

template <class Space, class S>
bool Odca<Space, S>::AccelerateWithShare(const Kinematics<Space, S>& kinematics,
                                         const VectorX<S>& feedback, SelfStress<Space, S>& stress,
                                         VectorX<S>& udot, VectorX<S>* lambda) {
  equations_.AccelerateWithShare(
      kinematics, feedback, stress, udot, lambda, [&] { SolveEquations(); },
      [&] { return sweep_.multipliers(); });
  return true;
}

template <class Space, class S>
bool Odca<Space, S>::RightHandSide(SpeedsUsed speeds, Kinematics<Space, S>& kinematics,
                                   std::span<const S> q, std::span<const S> u, std::span<S> qdot,
                                   std::span<S> udot) {
  if constexpr (std::is_same_v<S, double>) {
    by_short_cut_ = lane_ != nullptr
                        ? lane_->Evaluate(speeds, q, u, qdot, udot)
                        : short_cut_ != nullptr && tries_short_cut_ &&
                              short_cut_->Evaluate(speeds, &kinematics, q, u, qdot, udot);
    return by_short_cut_;
  }
  return false;
}

template <class Space, class S>
std::optional<Correction<S>> Odca<Space, S>::Project(std::span<S> q, std::span<S> u, S goal) {
  if constexpr (std::is_same_v<S, double>) {
    if (short_cut_ != nullptr && tries_short_cut_) return short_cut_->Project(q, u, goal);
  }
  return std::nullopt;
}

template <class Space, class S>
void Odca<Space, S>::Start(const Kinematics<Space, S>& kinematics) {
  if constexpr (std::is_same_v<S, double>) {
    tries_short_cut_ = short_cut_ != nullptr && short_cut_->IsUsable(kinematics);
  }
}

/// Computes the velocity violation joint by joint: no vector of rows is needed between.
template <class Space, class S>
bool Odca<Space, S>::CompleteSpeeds(Kinematics<Space, S>& kinematics, VectorX<S>& u) {
  kinematics.UpdateVelocity(u);
  equations_.SetMissed(kinematics);
  SweepTo(change_, nullptr);
  u += change_;
  return true;
}

template <class Space, class S>
std::vector<NamedCount> Odca<Space, S>::Counters() const {
  return {{"plan_depth", plan_.depth()},
          {"plan_largest_join", plan_.largest_join()},
          {"rhs_operations", by_short_cut_ ? short_cut_->operations() : sweep_.operations()}};
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
