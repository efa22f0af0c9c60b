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

#include <limits>

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
  DenseEquations(const Mechanism<Space, S>& mechanism, SolverKind kind)
      : mechanism_(mechanism),
        kind_(kind),
        dynamics_(mechanism),
        M_(MatrixX<S>::Zero(mechanism.num_u(), mechanism.num_u())),
        J_(MatrixX<S>::Zero(mechanism.num_rows(), mechanism.num_u())),
        lambda_(VectorX<S>::Zero(mechanism.num_rows())),
        zero_(VectorX<S>::Zero(mechanism.num_u())),
        missed_(lambda_),
        change_(zero_),
        loop_(mechanism.RowsOfConstraints()) {
    const int n = mechanism.num_u(), m = mechanism.num_rows();
    for (int k = 0; k < static_cast<int>(mechanism.constraints().size()); ++k) {
      if (!mechanism.joints()[mechanism.constraints()[k]].on_loop) loop_.SetOnNoLoop(k);
    }
    if (kind_ == SolverKind::kAsPublished) {
      augmented_.setZero(n + m, n + m);
      rhs_.setZero(n + m);
      solution_.setZero(n + m);
      lu_ = PivotedLu<S>(n + m);
    } else {
      W_.setZero(n, m);
      response_.setZero(m, m);
      mass_factor_.compute(MatrixX<S>::Identity(n, n).eval());
    }
  }

  /// Numbers in all its matrices.
  static double Numbers(const Mechanism<Space, S>& mechanism, SolverKind kind) {
    const double n = mechanism.num_u(), m = mechanism.num_rows();
    if (kind == SolverKind::kAsPublished) return n * n + n * m + 2.0 * (n + m) * (n + m);
    return 2.0 * n * n + 2.0 * n * m + 6.0 * m * m;  // loop_solver.h has five of m x m
  }

  /// M, J and the factors of (1) or S.
  Outcome Factor(const Kinematics<Space, S>& kinematics, Conditioning& found) {
    dynamics_.Jacobian(kinematics, J_);
    return kind_ == SolverKind::kAsPublished ? FactorAugmented(kinematics, found)
                                             : FactorResponse(kinematics, found);
  }

  /// As ConstraintSolver::Solve().
  void Solve(const VectorX<S>& given, const VectorX<S>& target, VectorX<S>& x, VectorX<S>* lambda) {
    const VectorX<S>& force = given.size() > 0 ? given : zero_;
    const int n = mechanism_.num_u(), m = mechanism_.num_rows();
    if (kind_ == SolverKind::kAsPublished) {
      rhs_.head(n) = force;
      rhs_.tail(m) = target;
      solution_ = rhs_;
      lu_.Solve(solution_);
      x = solution_.head(n);
      if (lambda != nullptr) *lambda = -solution_.tail(m);
      return;
    }
    // S lambda = target - J M^-1 force, x = M^-1 (force + J^T lambda): on the way x is L^-1 of the
    // bracket, and W lambda is L^-1 J^T lambda
    x = force;
    mass_factor_.matrixL().solveInPlace(x);
    if (m > 0) {
      lambda_ = target;
      lambda_.noalias() -= W_.transpose() * x;
      loop_.Apply(lambda_);
      loop_.ApplyTransposed(lambda_);
      x.noalias() += W_ * lambda_;
      if (lambda != nullptr) *lambda = lambda_;
    }
    mass_factor_.matrixU().solveInPlace(x);
  }

  /// Level velocity: u less M^-1 J^T S^+ (J u + b), with the current J: no force, and the target
  /// -(J u + b).
  void CompleteSpeeds(Kinematics<Space, S>& kinematics, VectorX<S>& u) {
    SpeedBias(kinematics, zero_, missed_);
    missed_ = -missed_;
    missed_.noalias() -= J_ * u;
    Solve(zero_, missed_, change_, nullptr);
    u += change_;
  }

 private:
  /// The matrix of (1). Rows of J are components along D of the cut joints at Mo.
  Outcome FactorAugmented(const Kinematics<Space, S>& kinematics, Conditioning& found) {
    const int n = mechanism_.num_u(), m = mechanism_.num_rows();
    dynamics_.MassMatrix(kinematics, Masses::kPhysical, M_);
    augmented_.topLeftCorner(n, n) = M_;
    augmented_.topRightCorner(n, m) = J_.transpose();
    augmented_.bottomLeftCorner(m, n) = J_;
    augmented_.bottomRightCorner(m, m).setZero();
    lu_.Factor(augmented_);
    const S rcond = lu_.PivotRatio();
    found.rank = LoopRank(mechanism_, 0);
    found.rcond = static_cast<double>(rcond);
    // a pivot below a few eps of the largest is round-off of the elimination
    return rcond > S(16) * std::numeric_limits<S>::epsilon() ? Outcome::kFinished
                                                             : Outcome::kSingular;
  }

  /// Factors S with the bodies' masses. If it is suspicious, takes directions and weights from S
  /// with unit masses, then factors the physical one again (loop_solver.h).
  Outcome FactorResponse(const Kinematics<Space, S>& kinematics, Conditioning& found) {
    found.rank = LoopRank(mechanism_, 0);
    found.smallest_weight = 1.0;
    found.is_regularized = false;
    FormResponse(kinematics, Masses::kPhysical);
    if (mass_factor_.info() != Eigen::Success) return Outcome::kNonFinite;
    if (loop_.size() == 0) return Outcome::kFinished;
    SetScales(kinematics, Masses::kPhysical);
    if (!loop_.FactorScaled(response_)) {
      SetScales(kinematics, Masses::kGeometric);
      FormResponse(kinematics, Masses::kGeometric);
      if (!response_.allFinite()) return Outcome::kNonFinite;
      loop_.FactorGeometric(response_, kinematics.regularization());
      found.rank = LoopRank(mechanism_, loop_.size() - loop_.rank());
      found.smallest_weight = static_cast<double>(loop_.smallest_weight());
      found.is_regularized = loop_.smallest_weight() < S(1);
      FormResponse(kinematics, Masses::kPhysical);
      if (!loop_.FactorRegularized(response_)) return Outcome::kSingular;
    }
    found.rcond = static_cast<double>(loop_.rcond());
    return Outcome::kFinished;
  }

  /// W = L^-1 J^T and S = W^T W with these masses; leaves the factor of M in mass_factor_.
  void FormResponse(const Kinematics<Space, S>& kinematics, Masses masses) {
    dynamics_.MassMatrix(kinematics, masses, M_);
    mass_factor_.compute(M_);
    if (loop_.size() == 0) return;  // a tree: nothing is constrained
    W_ = J_.transpose();
    mass_factor_.matrixL().solveInPlace(W_);
    response_.noalias() = W_.transpose() * W_;
  }

  void SetScales(const Kinematics<Space, S>& kinematics, Masses masses) {
    for (int j = 0; j < static_cast<int>(mechanism_.constraints().size()); ++j) {
      loop_.SetScale(j, FreeResponse(kinematics, masses, mechanism_.constraints()[j]));
    }
  }

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
