// Coordinate reduction: the speeds are split into independent u_I and dependent u_D,
//
//   J_D u_D = -J_I u_I - b,      J_D udot_D = gamma - J_I udot_I,                   (1)
//   u = B u_I,  udot = B udot_I + c,  B = [1; -J_D^-1 J_I],  c = [0; J_D^-1 gamma],  (2)
//   (B^T M B) udot_I = -B^T (h + M c).                                            (3)
//
// Velocity level (the paper's): the state carries q and u_I, u_D follows from (1). Acceleration
// level: the state carries q and all speeds, only accelerations follow from (1).
//
// As published: the independent set is fixed (the mechanism's, or chosen at the start) and all rows
// of J are used; it ends as `singular` when J_D does, also where redundant constraints leave more
// rows than dependent speeds. Automatic ("rank-revealing"): at the start the rank is taken from the
// geometric response of loop_solver.h, dependent speeds and as many rows from QR of J with
// pivoting; at each accepted step a partition whose conditioning has fallen below a tenth of the
// best one's is replaced, which changes the state and restarts the integrator. The number of
// dependent speeds stays that of the start; where the rank has grown beyond it (a start in a
// singular position) the run ends as `singular`. J_D is factored by LU either way.
//
// At the other levels the state does not depend on the partition, so that it may change its size.
// Where it is suspicious, or leaves rows out, a basis of the free directions takes its place
// (null_space.h). Start() and BeginStep() may allocate.
#pragma once

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <memory>

#include "mechanism/formulation/formulation.h"
#include "mechanism/loops/tree_dynamics.h"
#include "reduction/null_space.h"
#include "reduction/partition.h"

namespace loopbench::reduction {

template <class Space, class S>
class Reduction final : public Formulation<Space, S> {
 public:
  /// An automatic set is replaced when its reciprocal condition is below this part of the best.
  static constexpr double kReplaceBelow = 0.1;
  /// Below this ratio of its pivots a partition gives way to the null space.
  static constexpr double kSuspicious = 0.1;

  Reduction(const Mechanism<Space, S>& mechanism, FormulationOptions options);

  Outcome Start(S t, const VectorX<S>& q, const VectorX<S>& u) override;

  /// Indices into u, ascending.
  const std::vector<int>& independent() const { return independent_; }

 private:
  int num_state_speeds() const override;
  int state_speed(int i) const override;
  Outcome CompleteSpeeds() override;
  Outcome Correct(const VectorX<S>& violation, VectorX<S>& change) override;
  Outcome Accelerations() override;
  void Multipliers(VectorX<S>& lambda) override;
  void SolveConstrained(const VectorX<S>& force, const VectorX<S>& target, VectorX<S>& x,
                        VectorX<S>& lambda) override;
  bool ChangeMode() override;

  Outcome FactorOnce();
  /// LU of J_D and the basis B, J being current; the reciprocal condition.
  S FactorPartition();
  void FactorNullSpace();
  /// x of M x - J^T lambda = force, J x = target by (2) and (3), and lambda from that x. False
  /// where M is not positive definite.
  bool SolveMotion(const VectorX<S>& force, const VectorX<S>& target, VectorX<S>& x);
  void SolveForces(const VectorX<S>& force, const VectorX<S>& x, VectorX<S>& lambda);
  void SetPartition(const Partition<S>& partition);

  using Base = Formulation<Space, S>;
  using Base::diagnostics_;
  using Base::kinematics_;
  using Base::mechanism_;
  using Base::u_;
  using Base::udot_;

  TreeDynamics<Space, S> dynamics_;
  std::vector<int> independent_, dependent_, rows_;
  long factored_version_ = -1;
  bool outgrown_ = false;  ///< the rank exceeds the partition's
  MatrixX<S> M_, J_, J_D_, J_I_, solved_, B_, MB_, reduced_;
  VectorX<S> h_, gamma_, force_, c_, residual_, rows_rhs_, dependent_speeds_, independent_speeds_,
      bias_;
  Eigen::PartialPivLU<MatrixX<S>> lu_;
  Eigen::LLT<MatrixX<S>> reduced_factor_;
  std::unique_ptr<NullSpace<Space, S>> null_space_;  ///< null at velocity level and as published
  bool uses_null_space_ = false;                     ///< since the last factorisation
};

}  // namespace loopbench::reduction
