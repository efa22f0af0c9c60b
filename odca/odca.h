// O-DCA as a formulation: leaves from the current poses and motions, a sweep, joint accelerations.
// The mathematics and the paper's equation numbers are in README.md beside this file.
#pragma once

#include "odca/sweep.h"

namespace loopbench::odca {

/// The plan of a mechanism: every joint with constrained directions, tree joint or not.
template <class Space, class S>
Plan MakePlan(const Mechanism<Space, S>& mechanism, const PlanOptions& options = {});

template <class Space, class S>
class Odca final : public Formulation<Space, S> {
 public:
  /// As published, joints to Ground close at the root (the paper's section 3.1); else as early as
  /// possible. `plan` overrides that choice.
  Odca(const Mechanism<Space, S>& mechanism, FormulationOptions options);
  Odca(const Mechanism<Space, S>& mechanism, FormulationOptions options, const PlanOptions& plan);

  const Plan& plan() const { return plan_; }
  const Sweep<Space, S>& sweep() const { return sweep_; }

  /// Constraint force of a user joint after an evaluation: [moment; force] on Q at the joint's
  /// point, ground axes. Unique only where the joint's loops carry no self-stress. Zero where the
  /// coordinate set has no free speed: then nothing is evaluated.
  Motion<Space, S> JointForce(int joint) const;

 private:
  Outcome CompleteSpeeds() override;
  Outcome Correct(const VectorX<S>& violation, VectorX<S>& change) override;
  Outcome Accelerations() override;
  void Multipliers(VectorX<S>& lambda) override;
  void SolveConstrained(const VectorX<S>& force, const VectorX<S>& target, VectorX<S>& x,
                        VectorX<S>& lambda) override;
  Outcome AssembleOnce();
  /// b_ of a body: its acceleration under its wrench alone, with [moment; force] at its centre of
  /// mass.
  void SetFree(int body, const Motion<Space, S>& wrench);
  /// H^T (A_Q - A_P) of a tree joint at its point, centripetal terms not included.
  void TreeMotions(std::span<const Motion<Space, S>> A, VectorX<S>& result) const;

  using Base = Formulation<Space, S>;
  using Base::diagnostics_;
  using Base::kinematics_;
  using Base::mechanism_;
  using Base::u_;
  using Base::udot_;

  Plan plan_;
  Sweep<Space, S> sweep_;
  long assembled_version_ = -1;
  std::vector<Motion<Space, S>> wrenches_, b_, A_, c0_;
  VectorX<S> change_;
};

}  // namespace loopbench::odca
