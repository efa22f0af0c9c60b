#include "mechanism/loops/direction_weights.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "mechanism/algebra/instantiate.h"
#include "mechanism/algebra/symmetric_eigen.h"

namespace loopbench {

template <class S>
DirectionWeights<S>::DirectionWeights(std::span<const int> rows)
    : rows_(rows.begin(), rows.end()), rank_(std::accumulate(rows.begin(), rows.end(), 0)) {
  pivots_.setOnes(rank_);
  weights_.setOnes(rank_);
}

/// Joint by joint: X_jj = V diag(p) V^T, then X := X - X_.j V diag(1/p) V^T X_j. for the joints
/// that follow. Directions that are round-off respond to nothing.
template <class S>
void DirectionWeights<S>::FindPivots(Eigen::Ref<MatrixX<S>> X, Eigen::Ref<MatrixX<S>> work) {
  using std::sqrt;
  if (rows_.size() == 1) return;  // they are the eigenvalues
  const S round_off = S(4) * std::numeric_limits<S>::epsilon();
  Eigen::Index first = 0;
  for (const int rows : rows_) {
    const Eigen::Index next = first + rows, rest = X.rows() - next;
    auto V = work.topLeftCorner(rows, rows);
    auto p = pivots_.segment(first, rows);
    SymmetricEigen<S>(X.block(first, first, rows, rows), V, p);
    auto Y = work.block(next, 0, rest, rows);
    Y.noalias() = X.block(next, first, rest, rows) * V;
    for (int c = 0; c < rows; ++c) Y.col(c) *= p[c] > round_off ? S(1) / sqrt(p[c]) : S(0);
    X.bottomRightCorner(rest, rest).noalias() -= Y * Y.transpose();
    first = next;
  }
  if (!pivots_.allFinite()) pivots_.setZero();  // which cannot be sorted
  std::sort(pivots_.begin(), pivots_.end());
}

template <class S>
void DirectionWeights<S>::Weigh(const VectorX<S>& lambda, S share) {
  using std::expm1;
  const Eigen::Index size = lambda.size();
  const S eps = std::numeric_limits<S>::epsilon();
  largest_ = std::max(size > 0 ? lambda[size - 1] : S(0), S(kMinResponse));
  const S theta = std::max(share, S(64) * eps) * largest_;
  const S least = std::max(std::min(S(kMinEigenvalue), share / S(100)), S(4) * eps) * largest_;
  if (rows_.size() == 1) pivots_ = lambda;
  rank_ = 0;
  for (Eigen::Index i = 0; i < size; ++i) {
    const S known = std::max(lambda[i], S(0)) / least;
    const S ratio = std::min(S(std::max(pivots_[i], S(0)) / theta), S(known * known));
    // expm1 keeps the relative accuracy of small weights
    weights_[i] = -expm1(-ratio * ratio);
    if (weights_[i] >= S(1) / S(2)) ++rank_;
  }
  smallest_ = size > 0 ? weights_.minCoeff() : S(1);
}

#define LOOPBENCH_INSTANTIATE(S) template class DirectionWeights<S>;
LOOPBENCH_FOR_EACH_SCALAR(LOOPBENCH_INSTANTIATE)
#undef LOOPBENCH_INSTANTIATE

}  // namespace loopbench
