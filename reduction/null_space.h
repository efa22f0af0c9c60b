// Coordinate reduction without a choice of coordinates: uses a basis of the free directions if no
// set of independent speeds is suitable (near singular configurations) or known (redundant
// constraints).
//
// With the mass matrix of unit bodies M_g = L L^T and the free responses K K^T of loop_solver.h,
//
//   B = K^-1 J L^-T = U diag(sigma) V^T,                                                     (4)
//
// and weights w_i from B B^T (direction_weights.h), the speeds are u = L^-T V z. A direction with
// w_i = 1 within kHard is dependent, its z_i given: sigma_i z_i = (U^T K^-1 gamma)_i =: c_i. All
// others are independent,
//
//   (V_N^T Mh V_N + diag(k)) z_N = -V_N^T (L^-1 h + Mh V_D z_D) + diag(k) c_N / sigma_N,      (5)
//   Mh = L^-1 M L^-T,   k_i = w_i / ((1 - w_i) v_i^T Mh^-1 v_i),
//
// and k_i is the stiffness that still holds a degenerating direction. It makes (5) equal to the
// regularized equations of loop_solver.h: there 1 / k_i is added to the response.
//
// Basis by singular values: Singh and Likins, J. Appl. Mech. 52 (1985) 943; Mani, Haug and
// Atkinson, J. Mech. Trans. Autom. Des. 107 (1985) 82.
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "mechanism/algebra/factors.h"
#include "mechanism/algebra/singular_values.h"
#include "mechanism/loops/direction_weights.h"
#include "mechanism/loops/tree_dynamics.h"

namespace loopbench::reduction {

template <class Space, class S>
class NullSpace {
 public:
  /// 1 - w below which a direction counts as dependent: its stiffness would be a million times its
  /// inertia, with an equal loss by rounding.
  static constexpr double kHard = 1e-6;

  explicit NullSpace(const Mechanism<Space, S>& mechanism)
      : mechanism_(mechanism),
        K_(mechanism.constraints().size()),
        B_(MatrixX<S>::Zero(mechanism.num_rows(), mechanism.num_u())),
        response_(MatrixX<S>::Zero(mechanism.num_rows(), mechanism.num_rows())),
        work_(response_),
        M_g_(MatrixX<S>::Zero(mechanism.num_u(), mechanism.num_u())),
        Mh_(M_g_),
        basis_(M_g_),
        reduced_(M_g_),
        weights_(mechanism.RowsOfConstraints()),
        lambda_(VectorX<S>::Zero(mechanism.num_rows())),
        rows_(lambda_),
        c_(VectorX<S>::Zero(std::min(mechanism.num_rows(), mechanism.num_u()))),
        z_(VectorX<S>::Zero(mechanism.num_u())),
        speeds_(z_),
        column_(z_) {}

  /// The basis at the current positions, J being theirs: B = K^-1 J L^-T of (4) and its singular
  /// values. Keeps the K of each cut joint in K_, V in svd_. Allocates only at first.
  void Factor(const Kinematics<Space, S>& kinematics, TreeDynamics<Space, S>& dynamics,
              const MatrixX<S>& J) {
    using std::sqrt;
    dynamics.MassMatrix(kinematics, Masses::kGeometric, M_g_);
    L_.compute(M_g_);
    // B^T = L^-1 J^T by columns of J's rows, then K^-1 from the left
    B_ = J;
    for (Eigen::Index r = 0; r < B_.rows(); ++r) {
      column_ = B_.row(r).transpose();
      L_.matrixL().solveInPlace(column_);
      B_.row(r) = column_.transpose();
    }
    for (std::size_t k = 0; k < K_.size(); ++k) {
      const int index = mechanism_.constraints()[k];
      const Joint<Space, S>& joint = mechanism_.joints()[index];
      const CholeskyFactor<JointMatrix<S>> free(
          FreeResponse(kinematics, Masses::kGeometric, index));
      K_[k] = free.matrixL();
      auto block = B_.middleRows(joint.row, joint.num_constraints());
      K_[k].template triangularView<Eigen::Lower>().solveInPlace(block);
    }
    svd_.Compute(B_);
    const auto& sigma = svd_.sigma();
    response_.noalias() = B_ * B_.transpose();
    weights_.FindPivots(response_, work_);
    lambda_.setZero();
    lambda_.tail(sigma.size()) = sigma.reverse().cwiseAbs2();
    weights_.Weigh(lambda_, S(kinematics.regularization()));
    num_dependent_ = 0;
    for (Eigen::Index i = 0; i < sigma.size(); ++i) {
      if (S(1) - WeightOf(i) < S(kHard)) ++num_dependent_;
    }
    rcond_ = num_dependent_ > 0 ? sigma[num_dependent_ - 1] / sqrt(weights_.largest()) : S(1);
  }

  /// udot from M udot + h = J^T lambda, J udot = gamma; with h = 0 the smallest udot in the metric
  /// M that meets gamma. By (5): z_D from gamma, then the equations of z_N, whose matrix is
  /// `reduced_` and whose right side is built in the tail of z_. Last udot = L^-T V z. False where
  /// M is not positive definite.
  bool Accelerate(const MatrixX<S>& M, const VectorX<S>& h, const VectorX<S>& gamma,
                  VectorX<S>& udot) {
    const Eigen::Index n = M.rows(), d = num_dependent_, f = n - d;
    const auto& sigma = svd_.sigma();
    const auto& V = svd_.V();
    // Mh V = L^-1 M L^-T V, V^T Mh V
    Mh_ = M;
    L_.matrixL().solveInPlace(Mh_);
    Mh_.transposeInPlace();
    L_.matrixL().solveInPlace(Mh_);
    ToDirections(gamma);
    z_.setZero();
    for (Eigen::Index i = 0; i < d; ++i) z_[i] = c_[i] / sigma[i];
    speeds_.noalias() = V * z_;
    column_ = h;
    L_.matrixL().solveInPlace(column_);
    column_.noalias() += Mh_ * speeds_;
    basis_.leftCols(f).noalias() = Mh_ * V.rightCols(f);
    reduced_.topLeftCorner(f, f).noalias() = V.rightCols(f).transpose() * basis_.leftCols(f);
    z_.tail(f).noalias() -= V.rightCols(f).transpose() * column_;  // zero so far
    bool factored = false;
    for (Eigen::Index i = d; i < c_.size(); ++i) {
      if (IsLeftOut(i)) continue;
      if (!factored) Mh_factor_.compute(Mh_);
      factored = true;
      column_ = V.col(i);
      Mh_factor_.solveInPlace(column_);
      const S stiffness = WeightOf(i) / ((S(1) - WeightOf(i)) * V.col(i).dot(column_));
      reduced_(i - d, i - d) += stiffness;
      z_[i] += stiffness * c_[i] / sigma[i];
    }
    if (f > 0) {
      reduced_factor_.compute(reduced_.topLeftCorner(f, f));
      if (reduced_factor_.info() != Eigen::Success) return false;
      auto free = z_.tail(f);
      reduced_factor_.solveInPlace(free);
    }
    udot.noalias() = V * z_;
    L_.matrixU().solveInPlace(udot);
    return true;
  }

  /// lambda for which J^T lambda is nearest to `force`.
  /// lambda = K^-T U diag(1 / sigma) V^T L^-1 force; directions with no weight carry nothing.
  void Multipliers(const VectorX<S>& force, VectorX<S>& lambda) {
    column_ = force;
    L_.matrixL().solveInPlace(column_);
    c_.noalias() = svd_.V().leftCols(c_.size()).transpose() * column_;
    for (Eigen::Index i = 0; i < c_.size(); ++i) {
      c_[i] = IsLeftOut(i) ? S(0) : S(c_[i] / svd_.sigma()[i]);
    }
    lambda.noalias() = svd_.U().leftCols(c_.size()) * c_;
    for (std::size_t k = 0; k < K_.size(); ++k) {
      const Joint<Space, S>& joint = mechanism_.joints()[mechanism_.constraints()[k]];
      auto part = lambda.segment(joint.row, joint.num_constraints());
      K_[k].template triangularView<Eigen::Lower>().transpose().solveInPlace(part);
    }
  }

  int rank() const { return weights_.rank(); }
  S smallest_weight() const { return weights_.smallest(); }
  /// Ratio of the extreme singular values of the dependent directions.
  S rcond() const { return rcond_; }

 private:
  /// Singular values descend, eigenvalues of B B^T ascend, and there may be more of them.
  S WeightOf(Eigen::Index i) const { return weights_[lambda_.size() - 1 - i]; }
  bool IsLeftOut(Eigen::Index i) const { return weights_.IsLeftOut(lambda_.size() - 1 - i); }
  /// c = U^T K^-1 rows.
  /// K is block-diagonal, a block per cut joint.
  void ToDirections(const VectorX<S>& rows) {
    rows_ = rows;
    for (std::size_t k = 0; k < K_.size(); ++k) {
      const Joint<Space, S>& joint = mechanism_.joints()[mechanism_.constraints()[k]];
      auto part = rows_.segment(joint.row, joint.num_constraints());
      K_[k].template triangularView<Eigen::Lower>().solveInPlace(part);
    }
    c_.noalias() = svd_.U().leftCols(c_.size()).transpose() * rows_;
  }

  const Mechanism<Space, S>& mechanism_;
  int num_dependent_ = 0;
  S rcond_ = S(1);
  std::vector<JointMatrix<S>> K_;  ///< Cholesky factors, by constraint
  MatrixX<S> B_, response_, work_, M_g_, Mh_, basis_, reduced_;
  CholeskyFactor<MatrixX<S>> L_, Mh_factor_, reduced_factor_;
  SingularValues<S> svd_;
  DirectionWeights<S> weights_;
  VectorX<S> lambda_, rows_, c_, z_, speeds_, column_;
};

}  // namespace loopbench::reduction
