// O-DCA as a constraint solver: leaves from poses and forces, a sweep, speeds of joints.
// The mathematics and the paper's equation numbers are in README.md beside this file.
#pragma once

#include <memory>
#include <optional>

#include "mechanism/formulation/constraint_solver.h"
#include "mechanism/loops/body_equations.h"
#include "odca/short_cut.h"
#include "odca/sweep.h"

namespace loopbench::odca {

/// Every joint with constrained directions, tree joint or not, under its index.
template <class Space, class S>
std::vector<PlanJoint> PlanJoints(const Mechanism<Space, S>& mechanism);

/// The plan of a mechanism, over these joints.
template <class Space, class S>
Plan MakePlan(const Mechanism<Space, S>& mechanism, const PlanOptions& options = {});

template <class Space, class S>
class Odca final : public ConstraintSolver<Space, S> {
 public:
  /// `mechanism` must outlive the solver. `plan` overrides PlanOptionsOf().
  Odca(const Mechanism<Space, S>& mechanism, const FormulationOptions& options,
       const std::optional<PlanOptions>& plan = {});

  const Plan& plan() const { return plan_; }
  const Sweep<Space, S>& sweep() const { return sweep_; }

  Outcome Factor(const Kinematics<Space, S>& kinematics) override;
  void Solve(const VectorX<S>& force, const VectorX<S>& target, VectorX<S>& x,
             VectorX<S>* lambda) override;
  /// From wrenches on bodies, as the paper does: neither h nor gamma is formed.
  bool CompleteSpeeds(Kinematics<Space, S>& kinematics, VectorX<S>& u) override;
  bool Accelerate(const Kinematics<Space, S>& kinematics, const VectorX<S>& feedback,
                  VectorX<S>& udot, VectorX<S>* lambda) override;
  bool AccelerateWithShare(const Kinematics<Space, S>& kinematics, const VectorX<S>& feedback,
                           SelfStress<Space, S>& stress, VectorX<S>& udot,
                           VectorX<S>* lambda) override;
  /// Any join that closes a loop may be regularized, also of tree joints.
  bool TakesWrenches() const override { return true; }
  void SolveWrenches(const VectorX<S>& wrenches, VectorX<S>& x, VectorX<S>* lambda) override;
  /// In double, unless as published: for pins in the plane and arms of revolute joints in space.
  bool RightHandSide(SpeedsUsed speeds, Kinematics<Space, S>& kinematics, std::span<const S> q,
                     std::span<const S> u, std::span<S> qdot, std::span<S> udot) override;
  /// In double, unless as published, as above.
  std::optional<Correction<S>> Project(std::span<S> q, std::span<S> u, S goal) override;
  /// Decides whether the fast path is tried from now on.
  void Start(const Kinematics<Space, S>& kinematics) override;
  /// Size of the plan, and multiply-adds since Factor() began.
  std::vector<NamedCount> Counters() const override;

  /// Returns the constraint force of a user joint after an evaluation: [moment; force] on Q at the
  /// joint's point, ground axes. Unique only if the joint's loops carry no self-stress. Zero if the
  /// coordinate set has no free speed: then nothing is evaluated.
  Wrench<Space, S> JointForce(int joint) const;

 private:
  /// Solves the equations as they are set.
  void SolveEquations();
  /// The same: x and multipliers.
  void SweepTo(VectorX<S>& x, VectorX<S>* lambda);

  const Mechanism<Space, S>& mechanism_;
  Plan plan_;
  Sweep<Space, S> sweep_;
  std::unique_ptr<ShortCut<Space>> short_cut_;        ///< null if there is none
  std::unique_ptr<pins::PathLane> lane_;              ///< null except for paths of batched runs
  bool tries_short_cut_ = true;                       ///< since Start()
  bool by_short_cut_ = false;                         ///< the last evaluation was
  const Kinematics<Space, S>* kinematics_ = nullptr;  ///< of the last Factor()
  BodyEquations<Space, S> equations_;
  VectorX<S> change_;
};

}  // namespace loopbench::odca
