// Coordinate reduction by dense matrices: the speeds are split into independent u_I and dependent
// u_D,
//
//   J_D u_D = -J_I u_I - b,      J_D udot_D = gamma - J_I udot_I,                   (1)
//   u = B u_I,  udot = B udot_I + c,  B = [1; -J_D^-1 J_I],  c = [0; J_D^-1 gamma],  (2)
//   (B^T M B) udot_I = -B^T (h + M c).                                            (3)
//
// Velocity level (the paper's): the state carries q and u_I, u_D follows from (1). Acceleration
// level: the state carries q and all speeds, only accelerations follow from (1).
//
// As published: the independent set is fixed (the mechanism's, or chosen at the start) and all rows
// of J are used. It ends as `singular` when J_D is singular, also if redundant constraints leave
// more rows than dependent speeds. Automatic ("rank-revealing"): the geometric response of
// loop_solver.h gives the rank at the start, QR of J with pivoting the dependent speeds and as many
// rows. At each accepted step a partition whose conditioning is below a tenth of the best one's is
// replaced, which changes the state and restarts the integrator. The number of dependent speeds
// keeps its initial value; if the rank exceeds it (a start in a singular configuration) the run
// ends as `singular`. J_D is factored by LU either way.
//
// At the other levels the state does not depend on the partition, so its size may change. If it is
// suspicious or omits rows, a basis of the free directions replaces it (null_space.h). Start() and
// Review() may allocate.
#pragma once

#include <memory>

#include "mechanism/algebra/pivoted_lu.h"
#include "mechanism/formulation/constraint_solver.h"
#include "mechanism/formulation/options.h"
#include "mechanism/loops/tree_dynamics.h"
#include "reduction/null_space.h"
#include "reduction/partition.h"

namespace loopbench::reduction {

template <class Space, class S>
class DenseReduction final : public ConstraintSolver<Space, S> {
 public:
  /// An automatic set is replaced when its reciprocal condition is below this part of the best.
  static constexpr double kReplaceBelow = 0.1;
  /// Below this ratio of its pivots a partition gives way to the null space.
  static constexpr double kSuspicious = 0.1;

  /// `mechanism` must outlive the solver.
  DenseReduction(const Mechanism<Space, S>& mechanism, const FormulationOptions& options);

  /// Indices into u, ascending.
  const std::vector<int>& independent() const { return independent_; }

  /// Computes LU of J_D and the basis B. Returns false if J_D is singular or, with a null space as
  /// replacement, suspicious.
  bool FactorPartition(const Kinematics<Space, S>& kinematics);
  /// FactorPartition(), or the basis of the null space.
  Outcome Factor(const Kinematics<Space, S>& kinematics) override;
  /// x by (2) and (3), and lambda from that x.
  void Solve(const VectorX<S>& force, const VectorX<S>& target, VectorX<S>& x,
             VectorX<S>* lambda) override;
  /// Independent coordinates and speeds stay, and the dependent ones follow; without a partition
  /// the smallest change in the metric M.
  void Correct(const VectorX<S>& target, VectorX<S>& x) override;
  /// At level velocity the independent speeds; the others follow by (1).
  const std::vector<int>* CarriedSpeeds() const override {
    return at_velocity_ ? &independent_ : nullptr;
  }
  bool CompleteSpeeds(Kinematics<Space, S>& kinematics, VectorX<S>& u) override;
  /// The partition.
  void Start(const Kinematics<Space, S>& kinematics) override;
  bool Review(const Kinematics<Space, S>& kinematics) override;
  void AppendMode(std::vector<int>& mode) const override;
  void TakeMode(std::span<const int> mode) override;

 private:
  /// LU of J_D, J being current; the ratio of its pivots, with rotations as lengths.
  S FactorDependencies();
  /// Computes c of (2) with `target` instead of gamma.
  void Dependent(const VectorX<S>& target, VectorX<S>& x);
  void FactorNullSpace(const Kinematics<Space, S>& kinematics);
  /// M, and the factors of (3), once per position; not before they are needed.
  void FactorMass();
  void SolveForces(const VectorX<S>& force, const VectorX<S>& x, VectorX<S>& lambda);
  void SetPartition(const Partition<S>& partition);

  const Mechanism<Space, S>& mechanism_;
  SolverKind kind_;
  bool at_velocity_;
  TreeDynamics<Space, S> dynamics_;
  const Kinematics<Space, S>* kinematics_ = nullptr;  ///< of the last Factor()
  std::vector<int> independent_, dependent_, rows_;
  bool mass_is_current_ = false;
  bool outgrown_ = false;  ///< the rank exceeds the partition's
  MatrixX<S> M_, J_, J_D_, J_I_, solved_, B_, MB_, reduced_;
  VectorX<S> zero_, c_, residual_, rows_rhs_, independent_speeds_, bias_;
  VectorX<S> speed_scale_;  ///< one over the mechanism's length for rotations, else 1
  VectorX<S> pivot_scale_;  ///< of dependent speeds
  PivotedLu<S> lu_;
  CholeskyFactor<MatrixX<S>> reduced_factor_;
  std::unique_ptr<NullSpace<Space, S>> null_space_;  ///< null at velocity level and as published
  bool uses_null_space_ = false;                     ///< since the last Factor()
};

}  // namespace loopbench::reduction
