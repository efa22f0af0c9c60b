// Equations (4) and (5) are in null_space.h. Rows of J are components along the directions D of the
// cut joints at their points Mo, columns belong to the speeds of the forest.
#include "reduction/null_space.h"

#include <algorithm>
#include <cmath>

#include "mechanism/algebra/instantiate.h"

namespace loopbench::reduction {

template <class Space, class S>
NullSpace<Space, S>::NullSpace(const Mechanism<Space, S>& mechanism)
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

/// B = K^-1 J L^-T of (4) and its singular values; the K of each cut joint is kept in K_, V in
/// svd_.
template <class Space, class S>
void NullSpace<Space, S>::Factor(const Kinematics<Space, S>& kinematics,
                                 TreeDynamics<Space, S>& dynamics, const MatrixX<S>& J) {
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
    const CholeskyFactor<JointMatrix<S>> free(FreeResponse(kinematics, Masses::kGeometric, index));
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

/// K is block-diagonal, a block per cut joint.
template <class Space, class S>
void NullSpace<Space, S>::ToDirections(const VectorX<S>& rows) {
  rows_ = rows;
  for (std::size_t k = 0; k < K_.size(); ++k) {
    const Joint<Space, S>& joint = mechanism_.joints()[mechanism_.constraints()[k]];
    auto part = rows_.segment(joint.row, joint.num_constraints());
    K_[k].template triangularView<Eigen::Lower>().solveInPlace(part);
  }
  c_.noalias() = svd_.U().leftCols(c_.size()).transpose() * rows_;
}

/// (5): z_D from gamma, then the equations of z_N, whose matrix is `reduced_` and whose right side
/// is built in the tail of z_. Last udot = L^-T V z.
template <class Space, class S>
bool NullSpace<Space, S>::Accelerate(const MatrixX<S>& M, const VectorX<S>& h,
                                     const VectorX<S>& gamma, VectorX<S>& udot) {
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

/// lambda = K^-T U diag(1 / sigma) V^T L^-1 force; directions with no weight carry nothing.
template <class Space, class S>
void NullSpace<Space, S>::Multipliers(const VectorX<S>& force, VectorX<S>& lambda) {
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

#define LOOPBENCH_INSTANTIATE(Space, S) template class NullSpace<Space, S>;
LOOPBENCH_FOR_EACH_SPACE_AND_SCALAR(LOOPBENCH_INSTANTIATE)
#undef LOOPBENCH_INSTANTIATE

}  // namespace loopbench::reduction
