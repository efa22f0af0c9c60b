// Couplings of joint coordinates and rotors (mechanism.h) with any solver of the joint constraints.
//
//   (M + R^T I R) x - J^T lambda - G^T mu = f,      J x = c,      G x = d
//
// G has a row per coupling, R one per rotor, I are the rotors' inertias. The rotors' efforts tau =
// -I R x are unknowns like mu. x0 is the inner solver's result for (f, c). A column of Y is its
// result for a row of G or R as force, with c = 0. Then
//
//   x = x0 + Y [mu; tau],   X = [G; R] Y,   (X + diag(0, I^-1)) [mu; tau] = [d; 0] - [G; R] x0
//
// X, symmetric and positive semidefinite, is the response of the mechanism to these forces. The sum
// is scaled by FreeResponseOf() and factored by Cholesky with pivoting. Couplings whose pivots are
// round-off depend on the other constraints: they carry no force. As published they end the run as
// `singular`. Rotors with such pivots are on coordinates that cannot move.
//
// Vectors of rows contain the rows of joints, then a number per coupling, which may be missing and
// is then zero. A position takes one solution of the inner solver per coupling and rotor.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "mechanism/formulation/constraint_solver.h"
#include "mechanism/formulation/options.h"
#include "mechanism/loops/tree_dynamics.h"

namespace loopbench {

template <class Space, class S>
class CoupledSolver final : public ConstraintSolver<Space, S> {
 public:
  /// `mechanism` must outlive the solver.
  CoupledSolver(const Mechanism<Space, S>& mechanism,
                std::unique_ptr<ConstraintSolver<Space, S>> inner, SolverKind kind);

  Outcome Factor(const Kinematics<Space, S>& kinematics) override;
  void Solve(const VectorX<S>& force, const VectorX<S>& target, VectorX<S>& x,
             VectorX<S>* lambda) override;
  bool Accelerate(const Kinematics<Space, S>& kinematics, const VectorX<S>& feedback,
                  VectorX<S>& udot, VectorX<S>* lambda) override;
  bool TakesWrenches() const override { return inner_->TakesWrenches(); }
  void SolveWrenches(const VectorX<S>& wrenches, VectorX<S>& x, VectorX<S>* lambda) override;
  /// The inner solver's change, then the smallest in the metric of the masses that satisfies the
  /// couplings.
  void Correct(const VectorX<S>& target, VectorX<S>& x) override;
  void Start(const Kinematics<Space, S>& kinematics) override { inner_->Start(kinematics); }
  bool Review(const Kinematics<Space, S>& kinematics) override {
    return inner_->Review(kinematics);
  }
  void AppendMode(std::vector<int>& mode) const override { inner_->AppendMode(mode); }
  void TakeMode(std::span<const int> mode) override { inner_->TakeMode(mode); }
  std::string WhySingular() const override;
  std::vector<NamedCount> Counters() const override { return inner_->Counters(); }

 private:
  /// Factors the scaled sum X + diag(0, I^-1); returns its rank.
  int FactorResponse();
  /// Sets rows_ and left_ from rows of joints and couplings, as far as there are any.
  void SetTarget(const VectorX<S>& target);
  /// Sets mu_, efforts of couplings, then of rotors, for [d; 0] in left_. Adds Y mu to x = x0.
  void Couple(VectorX<S>& x);
  /// Multipliers after Couple(), if lambda_ contains the inner solver's.
  void PutMultipliers(VectorX<S>& lambda);

  const Mechanism<Space, S>& mechanism_;
  std::unique_ptr<ConstraintSolver<Space, S>> inner_;
  SolverKind kind_;
  TreeDynamics<Space, S> dynamics_;
  Eigen::Index num_couplings_;
  MatrixX<S> G_, Y_, X_;    ///< G_: with R; X_: scaled sum, then L by pivot order
  VectorX<S> yield_;        ///< 0 by coupling, 1 / inertia by rotor
  VectorX<S> scale_;        ///< 1 / sqrt(FreeResponseOf() + yield_)
  std::vector<int> order_;  ///< rows of G_ by pivot
  int rank_ = 0;            ///< of X_
  VectorX<S> rows_, lambda_, lambda_change_, rest_, force_, column_, mu_, left_;
  std::vector<Acceleration<Space, S>> A_;
};

}  // namespace loopbench
