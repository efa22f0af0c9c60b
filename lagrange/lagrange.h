// Acceleration-level Lagrange multipliers on the dense equations of the spanning forest.
//
//   [ M  J^T ] [ udot    ]   [ -h    ]
//   [ J  0   ] [ -lambda ] = [ gamma ]                                            (1)
//
// As published: LU of (1) with partial pivoting; a pivot lost in round-off ends as `singular`.
// Rank-revealing: M = L L^T, S = (L^-1 J^T)^T (L^-1 J^T), lambda = S^+ (gamma +
// J M^-1 h) with the softened inverse of loop_solver.h; S in the same form with unit masses decides
// the rank. Velocity level: u - M^-1 J^T S^+ J u, the projection in the metric of M.
#pragma once

#include <Eigen/Cholesky>
#include <Eigen/LU>

#include "mechanism/formulation/formulation.h"
#include "mechanism/loops/loop_solver.h"
#include "mechanism/loops/tree_dynamics.h"

namespace loopbench::lagrange {

template <class Space, class S>
class Lagrange final : public Formulation<Space, S> {
 public:
  Lagrange(const Mechanism<Space, S>& mechanism, FormulationOptions options);

  /// lambda of the last evaluation: rows of the constraints as in TreeDynamics::Jacobian().
  const VectorX<S>& multipliers() const { return lambda_; }

 private:
  Outcome CompleteSpeeds() override;
  Outcome Correct(const VectorX<S>& violation, VectorX<S>& change) override;
  Outcome Accelerations() override;
  void Multipliers(VectorX<S>& lambda) override { lambda = lambda_; }
  /// M, J and the factors of (1) or S at the current positions, once per position.
  Outcome FactorOnce();
  Outcome FactorAugmented();
  Outcome FactorResponse();
  /// W = L^-1 J^T and S = W^T W with these masses; leaves the factor of M in mass_factor_.
  void FormResponse(Masses masses);
  void SetScales(Masses masses);
  void SolveConstrained(const VectorX<S>& force, const VectorX<S>& target, VectorX<S>& x,
                        VectorX<S>& lambda) override;

  using Base = Formulation<Space, S>;
  using Base::diagnostics_;
  using Base::kinematics_;
  using Base::mechanism_;
  using Base::u_;
  using Base::udot_;

  TreeDynamics<Space, S> dynamics_;
  long factored_version_ = -1;
  MatrixX<S> M_, J_, W_, response_;
  VectorX<S> h_, gamma_, lambda_, force_, target_, bias_, change_;
  MatrixX<S> augmented_;
  VectorX<S> rhs_, solution_;
  Eigen::PartialPivLU<MatrixX<S>> lu_;
  Eigen::LLT<MatrixX<S>> mass_factor_;
  LoopSolver<S> loop_;
};

}  // namespace loopbench::lagrange
