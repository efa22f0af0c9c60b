// Letters are those of loop_solver.h, where the formulas stand. Rows of X, and so all vectors here,
// are components along the directions D of the joints, [rad or m] per [N m or N].
#include "mechanism/loops/loop_solver.h"

#include <algorithm>
#include <cmath>

#include "mechanism/algebra/instantiate.h"
#include "mechanism/algebra/symmetric_eigen.h"

namespace loopbench {

template <class S>
LoopSolver<S>::LoopSolver(std::span<const int> rows, std::shared_ptr<LoopScratch<S>> scratch)
    : weights_(rows), scratch_(std::move(scratch)) {
  int numbers = 0;
  for (int r : rows) {
    parts_.push_back({size_, r, numbers});
    size_ += r;
    numbers += r * r;
  }
  inverse_scales_.assign(numbers, S(0));
  if (scratch_ == nullptr) scratch_ = std::make_shared<LoopScratch<S>>(size_);
  // an LLT that has computed nothing has no valid state to copy
  if (size_ > 0) cholesky_.compute(MatrixX<S>::Identity(size_, size_).eval());
  directions_.setIdentity(size_, size_);
  eigenvalues_.setZero(size_);
  inverse_norms_.setOnes(size_);
}

template <class S>
auto LoopSolver<S>::K_inverse(std::size_t joint) const {
  const Part& part = parts_[joint];
  return Eigen::Map<const MatrixX<S>>(&inverse_scales_[part.scale], part.rows, part.rows);
}

/// X_free = K K^T by Cholesky; what is kept is K^-1, lower triangular.
template <class S>
void LoopSolver<S>::SetScale(int joint, const JointMatrix<S>& free_response) {
  const Part& part = parts_[joint];
  Eigen::Map<MatrixX<S>> inverse(&inverse_scales_[part.scale], part.rows, part.rows);
  const Eigen::LLT<JointMatrix<S>> K(free_response);
  inverse.setIdentity();
  K.matrixL().solveInPlace(inverse);
}

/// B := K^-1 B, K being block-diagonal: a block per joint.
template <class S>
void LoopSolver<S>::ScaleRows(Eigen::Ref<MatrixX<S>> B) const {
  for (std::size_t j = 0; j < parts_.size(); ++j) {
    const auto K = K_inverse(j);
    // K^-1 is lower triangular: work from the last row up, in place.
    for (Eigen::Index r = K.rows() - 1; r >= 0; --r) {
      const Eigen::Index row = parts_[j].row + r;
      B.row(row) *= K(r, r);
      for (Eigen::Index c = 0; c < r; ++c) B.row(row) += K(r, c) * B.row(parts_[j].row + c);
    }
  }
}

/// (K^-1 (K^-1 X)^T) is K^-1 X K^-T, X being symmetric.
template <class S>
auto LoopSolver<S>::Scaled(const ConstRef& X) {
  auto scaled = scratch_->scaled.topLeftCorner(size_, size_);
  auto work = scratch_->work.topLeftCorner(size_, size_);
  work = X;
  ScaleRows(work);
  scaled = work.transpose();
  ScaleRows(scaled);
  return scaled;
}

/// "plain": X = L L^T, T = L^-1, which takes the place of the paper's inverses in (17), (42), (66).
template <class S>
bool LoopSolver<S>::FactorPlain(const ConstRef& X, S scale, S tolerance) {
  form_ = Form::kPlain;
  rcond_ = S(0);
  cholesky_.compute(X);
  // a factorisation that broke off has no smallest pivot: it met one that is not positive
  if (cholesky_.info() != Eigen::Success) return false;
  const S smallest = cholesky_.matrixLLT().diagonal().minCoeff();
  rcond_ = smallest * smallest / scale;
  return rcond_ > tolerance;
}

/// "scaled": K^-1 X K^-T = L L^T, T = L^-1 K^-1.
template <class S>
bool LoopSolver<S>::FactorScaled(const ConstRef& X) {
  form_ = Form::kScaled;
  cholesky_.compute(Scaled(X));
  rcond_ = S(0);
  if (cholesky_.info() != Eigen::Success) return false;
  const S smallest = cholesky_.matrixLLT().diagonal().minCoeff();
  rcond_ = smallest * smallest;
  return rcond_ >= S(kSuspicious);
}

/// "geometric": K_g^-1 X_g K_g^-T = U diag(lambda) U^T and the weights w_i; inverse_norms_ are
/// sqrt(w_i / lambda_i), so that T = diag(inverse_norms_) U^T K_g^-1.
template <class S>
void LoopSolver<S>::FactorGeometric(const ConstRef& X_geometric) {
  using std::sqrt;
  form_ = Form::kGeometric;
  const auto scaled = Scaled(X_geometric);
  auto work = scratch_->work.topLeftCorner(size_, size_);
  work = scaled;
  weights_.FindPivots(work, scratch_->rotated.topLeftCorner(size_, size_));
  SymmetricEigen<S>(scaled, directions_, eigenvalues_);
  weights_.Weigh(eigenvalues_);
  for (int i = 0; i < size_; ++i) {
    inverse_norms_[i] = weights_.IsLeftOut(i) ? S(0) : S(sqrt(weights_[i] / eigenvalues_[i]));
  }
  rcond_ = std::max(eigenvalues_[0], S(0)) / weights_.largest();
}

/// "softened": U and w_i stay from the geometry. The diagonal of R + diag(R_ii (1 / w_i - 1)) is
/// R_ii / w_i = N_i^2, so dividing by N from both sides leaves ones on it. inverse_norms_ are
/// the 1 / N_i.
template <class S>
bool LoopSolver<S>::FactorSoftened(const ConstRef& X) {
  using std::sqrt;
  form_ = Form::kSoftened;
  const auto scaled = Scaled(X);
  auto work = scratch_->work.topLeftCorner(size_, size_);
  auto rotated = scratch_->rotated.topLeftCorner(size_, size_);
  work.noalias() = scaled * directions_;
  rotated.noalias() = directions_.transpose() * work;
  for (int i = 0; i < size_; ++i) {
    const bool kept = !weights_.IsLeftOut(i) && rotated(i, i) > S(0);
    inverse_norms_[i] = kept ? S(sqrt(weights_[i] / rotated(i, i))) : S(0);
  }
  // unit diagonal before factoring; directions left out become rows of the identity
  for (int j = 0; j < size_; ++j) {
    for (int i = 0; i < size_; ++i) {
      rotated(i, j) = i == j ? S(1) : rotated(i, j) * inverse_norms_[i] * inverse_norms_[j];
    }
  }
  cholesky_.compute(rotated);
  return cholesky_.info() == Eigen::Success;
}

/// K^-1 first, then U^T and the inverse norms, then L^-1, as far as the form has them.
template <class S>
void LoopSolver<S>::Apply(Eigen::Ref<MatrixX<S>> B) const {
  if (form_ != Form::kPlain) ScaleRows(B);
  if (IsGeometric()) {
    auto vector = scratch_->vector.head(size_);
    for (Eigen::Index c = 0; c < B.cols(); ++c) {
      vector.noalias() = directions_.transpose() * B.col(c);
      B.col(c) = inverse_norms_.cwiseProduct(vector);
    }
  }
  if (form_ != Form::kGeometric) cholesky_.matrixL().solveInPlace(B);
}

/// The same factors transposed, in the opposite order.
template <class S>
void LoopSolver<S>::ApplyTransposed(Eigen::Ref<VectorX<S>> v) const {
  if (form_ != Form::kGeometric) cholesky_.matrixU().solveInPlace(v);
  if (IsGeometric()) {
    auto vector = scratch_->vector.head(size_);
    vector = inverse_norms_.cwiseProduct(v);
    v.noalias() = directions_ * vector;
  }
  if (form_ == Form::kPlain) return;
  for (std::size_t j = 0; j < parts_.size(); ++j) {
    const auto K = K_inverse(j);
    const int row = parts_[j].row;
    for (Eigen::Index c = 0; c < K.cols(); ++c) {
      S sum = S(0);
      for (Eigen::Index r = c; r < K.rows(); ++r) sum += K(r, c) * v[row + r];
      v[row + c] = sum;
    }
  }
}

#define LOOPBENCH_INSTANTIATE(S) template class LoopSolver<S>;
LOOPBENCH_FOR_EACH_SCALAR(LOOPBENCH_INSTANTIATE)
#undef LOOPBENCH_INSTANTIATE

}  // namespace loopbench
