// Multipliers of the cut joints, from the dense equations of the spanning forest.
//
//   [ M  J^T ] [ udot    ]   [ -h    ]
//   [ J  0   ] [ -lambda ] = [ gamma ]                                            (1)
//
// As published: LU of (1) with partial pivoting; a pivot lost in round-off ends as `singular`.
// Rank-revealing, with the regularized inverse of loop_solver.h, where S in the same form with unit
// masses decides the rank:
//
//   M = L L^T,      W = L^-1 J^T,      S = W^T W
//   lambda = S^+ (gamma + J M^-1 h),      udot = M^-1 (J^T lambda - h)
//
// Velocity level: u - M^-1 J^T S^+ J u, the projection in the metric of M.
#pragma once

#include "mechanism/algebra/pivoted_lu.h"
#include "mechanism/formulation/constraint_solver.h"
#include "mechanism/formulation/options.h"
#include "mechanism/loops/loop_solver.h"
#include "mechanism/loops/tree_dynamics.h"

namespace loopbench::lagrange {

template <class Space, class S>
class DenseEquations {
 public:
  /// `mechanism` must outlive this.
  DenseEquations(const Mechanism<Space, S>& mechanism, SolverKind kind);
  /// Numbers in all its matrices.
  static double Numbers(const Mechanism<Space, S>& mechanism, SolverKind kind);

  /// M, J and the factors of (1) or S.
  Outcome Factor(const Kinematics<Space, S>& kinematics, Conditioning& found);
  /// As ConstraintSolver::Solve().
  void Solve(const VectorX<S>& force, const VectorX<S>& target, VectorX<S>& x, VectorX<S>* lambda);
  /// Level velocity. Uses the violation J u + b, with the current J.
  void CompleteSpeeds(Kinematics<Space, S>& kinematics, VectorX<S>& u);

 private:
  Outcome FactorAugmented(const Kinematics<Space, S>& kinematics, Conditioning& found);
  Outcome FactorResponse(const Kinematics<Space, S>& kinematics, Conditioning& found);
  /// W = L^-1 J^T and S = W^T W with these masses; leaves the factor of M in mass_factor_.
  void FormResponse(const Kinematics<Space, S>& kinematics, Masses masses);
  void SetScales(const Kinematics<Space, S>& kinematics, Masses masses);

  const Mechanism<Space, S>& mechanism_;
  SolverKind kind_;
  TreeDynamics<Space, S> dynamics_;
  MatrixX<S> M_, J_, W_, response_;
  VectorX<S> lambda_, zero_, missed_, change_;
  MatrixX<S> augmented_;
  VectorX<S> rhs_, solution_;
  PivotedLu<S> lu_;
  CholeskyFactor<MatrixX<S>> mass_factor_;
  LoopSolver<S> loop_;
};

}  // namespace loopbench::lagrange
