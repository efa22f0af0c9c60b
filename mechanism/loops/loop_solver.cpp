// Symbols and formulas are defined in loop_solver.h. Rows of X, and so all vectors here, are
// components along the directions D of the joints, [rad or m] per [N m or N].
#include "mechanism/loops/loop_solver.h"

#include <algorithm>
#include <cmath>

#include "mechanism/algebra/instantiate.h"
#include "mechanism/algebra/lower_triangle.h"
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
  scales_.assign(numbers, S(0));
  if (scratch_ == nullptr) scratch_ = std::make_shared<LoopScratch<S>>(size_);
  if (size_ <= kSmallTriangle) {
    small_.setIdentity(size_, size_);
  } else {  // a factor that has computed nothing has no valid state to copy
    cholesky_.compute(MatrixX<S>::Identity(size_, size_).eval());
  }
  directions_.setIdentity(size_, size_);
  eigenvalues_.setZero(size_);
  inverse_norms_.setOnes(size_);
}

/// Factors X_free = K K^T by Cholesky: lower triangular, with reciprocals on the diagonal.
template <class S>
void LoopSolver<S>::SetScale(int joint, const JointMatrix<S>& free_response) {
  const Part& part = parts_[joint];
  std::copy_n(free_response.data(), part.rows * part.rows, &scales_[part.scale]);
  FactorLower(&scales_[part.scale], part.rows);
}

/// B := K^-1 B, K being block-diagonal: a block per joint.
template <class S>
void LoopSolver<S>::ScaleRows(Eigen::Ref<MatrixX<S>> B) const {
  for (Eigen::Index column = 0; column < B.cols(); ++column) {
    for (const Part& part : parts_) {
      MultiplyLower(&scales_[part.scale], part.rows, B.col(column).data() + part.row);
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

template <class S>
S LoopSolver<S>::Cholesky(const ConstRef& A) {
  if (size_ <= kSmallTriangle) {
    using std::max;
    small_ = A;
    return max(S(0), FactorLower(small_.data(), size_));  // 0 for NaN
  }
  cholesky_.compute(A);
  // a failed factorisation has no smallest pivot: it met a non-positive one
  if (cholesky_.info() != Eigen::Success) return S(0);
  const S smallest = cholesky_.matrixLLT().diagonal().minCoeff();
  return smallest * smallest;
}

/// "plain": X = L L^T, T = L^-1, which takes the place of the paper's inverses in (17), (42), (66).
template <class S>
bool LoopSolver<S>::FactorPlain(const ConstRef& X, S scale, S tolerance) {
  form_ = Form::kPlain;
  rcond_ = Cholesky(X) / scale;
  return rcond_ > tolerance;
}

template <class S>
S LoopSolver<S>::InversePivot(int i) const {
  return size_ <= kSmallTriangle ? small_(i, i) : S(1) / cholesky_.matrixLLT()(i, i);
}

/// "scaled": X = (K L) (K L)^T. A pivot of L L^T is the square of the ratio of two diagonals.
template <class S>
bool LoopSolver<S>::FactorScaled(const ConstRef& X) {
  form_ = Form::kScaled;
  rcond_ = S(0);
  if (!(Cholesky(X) > S(0))) return false;
  using std::min;
  rcond_ = S(1);
  bool is_regular = true;  // not decided by rcond_, of which a recording would note the row
  for (const Part& part : parts_) {
    for (int i = 0; i < part.rows; ++i) {
      const S root = scales_[part.scale + i * (part.rows + 1)] / InversePivot(part.row + i);
      const S ratio = root * root;
      rcond_ = min(rcond_, ratio);
      is_regular = ratio >= S(part.least) && is_regular;  // false for NaN, too
    }
  }
  return is_regular;
}

/// "geometric": K_g^-1 X_g K_g^-T = U diag(lambda) U^T and the weights w_i; inverse_norms_ are
/// sqrt(w_i / lambda_i), so that T = diag(inverse_norms_) U^T K_g^-1.
template <class S>
void LoopSolver<S>::FactorGeometric(const ConstRef& X_geometric, double regularization) {
  using std::sqrt;
  form_ = Form::kGeometric;
  for (const Part& part : parts_) InvertLower(&scales_[part.scale], part.rows);
  const auto scaled = Scaled(X_geometric);
  auto work = scratch_->work.topLeftCorner(size_, size_);
  work = scaled;
  weights_.FindPivots(work, scratch_->rotated.topLeftCorner(size_, size_));
  SymmetricEigen<S>(scaled, directions_, eigenvalues_);
  weights_.Weigh(eigenvalues_, S(regularization));
  for (int i = 0; i < size_; ++i) {
    inverse_norms_[i] = weights_.IsLeftOut(i) ? S(0) : S(sqrt(weights_[i] / eigenvalues_[i]));
  }
  rcond_ = std::max(eigenvalues_[0], S(0)) / weights_.largest();
}

/// Regularized: U and w_i are geometric. The diagonal of R + diag(R_ii (1 / w_i - 1)) is R_ii / w_i
/// = N_i^2, so dividing by N from both sides leaves ones on it. inverse_norms_ are the 1 / N_i.
template <class S>
bool LoopSolver<S>::FactorRegularized(const ConstRef& X) {
  using std::sqrt;
  form_ = Form::kRegularized;
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
  return Cholesky(rotated) > S(0);
}

/// K^-1 first, then U^T and the inverse norms, then L^-1, as far as the form has them.
template <class S>
void LoopSolver<S>::Apply(Eigen::Ref<MatrixX<S>> B) const {
  if (IsGeometric()) {
    ScaleRows(B);
    auto vector = scratch_->vector.head(size_);
    for (Eigen::Index c = 0; c < B.cols(); ++c) {
      vector.noalias() = directions_.transpose() * B.col(c);
      B.col(c) = inverse_norms_.cwiseProduct(vector);
    }
  }
  if (form_ == Form::kGeometric) return;
  if (size_ > kSmallTriangle) return cholesky_.matrixL().solveInPlace(B);
  for (Eigen::Index c = 0; c < B.cols(); ++c) SolveLower(small_.data(), size_, B.col(c).data());
}

/// Applies the same factors transposed, in the opposite order.
template <class S>
void LoopSolver<S>::ApplyTransposed(Eigen::Ref<VectorX<S>> v) const {
  if (form_ != Form::kGeometric) {
    if (size_ > kSmallTriangle) {
      cholesky_.matrixU().solveInPlace(v);
    } else {
      SolveLowerTransposed(small_.data(), size_, v.data());
    }
  }
  if (IsGeometric()) {
    auto vector = scratch_->vector.head(size_);
    vector = inverse_norms_.cwiseProduct(v);
    v.noalias() = directions_ * vector;
  }
  if (!IsGeometric()) return;
  for (const Part& part : parts_) {
    MultiplyLowerTransposed(&scales_[part.scale], part.rows, v.data() + part.row);
  }
}

#define LOOPBENCH_INSTANTIATE(S) template class LoopSolver<S>;
LOOPBENCH_FOR_EACH_SCALAR(LOOPBENCH_INSTANTIATE)
#undef LOOPBENCH_INSTANTIATE

}  // namespace loopbench
