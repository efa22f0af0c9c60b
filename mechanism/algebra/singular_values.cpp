#include "mechanism/algebra/singular_values.h"

#include <Eigen/Jacobi>
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "mechanism/algebra/instantiate.h"

namespace loopbench {

namespace {

using Index = Eigen::Index;

/// A smaller square has lost digits to underflow: columns that short, beside numbers of size one,
/// count as zero.
template <class S>
S LeastSquare() {
  return std::numeric_limits<S>::min() / std::numeric_limits<S>::epsilon();
}

template <class S>
S Product(const MatrixX<S>& A, Index p, Index q) {
  return A.col(p).dot(A.col(q));
}

/// Applies the reflection I - tau v v^T, v[0] = 1, to a column from some row on.
template <class S>
void Reflect(const S* v, const S& tau, Index size, S* column) {
  const Eigen::Map<const VectorX<S>> rest(v + 1, size - 1);
  Eigen::Map<VectorX<S>> below(column + 1, size - 1);
  const S along = tau * (column[0] + rest.dot(below));
  column[0] -= along;
  below -= along * rest;
}

}  // namespace

template <class S>
void SingularValues<S>::Compute(const MatrixX<S>& A) {
  Decompose(A, true);
}

template <class S>
void SingularValues<S>::ComputeValues(const MatrixX<S>& A) {
  Decompose(A, false);
}

template <class S>
void SingularValues<S>::Decompose(const MatrixX<S>& A, bool vectors) {
  constexpr int kMaxSweeps = 30;  // convergence is quadratic: three to six are usual
  wide_ = A.rows() < A.cols();
  if (wide_) {
    qr_ = A.transpose();
  } else {
    qr_ = A;
  }
  const Index size = qr_.cols();
  // squares near the largest or smallest number would overflow or underflow
  S scale = S(0);
  for (Index i = 0; i < qr_.size(); ++i) {
    using std::abs;
    scale = std::max(scale, S(abs(qr_.data()[i])));
  }
  if (scale > S(0)) qr_ /= scale;
  TriangulariseWithPivots();
  W_.setZero(size, size);
  for (Index j = 0; j < size; ++j) {
    for (Index i = j; i < size; ++i) W_(i, j) = qr_(j, i);
  }
  if (vectors) J_.setIdentity(size, size);
  squares_.resize(size);
  for (Index j = 0; j < size; ++j) squares_[j] = Product(W_, j, j);
  for (int sweep = 0; sweep < kMaxSweeps && Sweep(vectors); ++sweep) {
  }
  Sort(vectors);
  if (vectors) Assemble();
  sigma_ *= scale;
}

template <class S>
void SingularValues<S>::TriangulariseWithPivots() {
  using std::sqrt;
  const Index rows = qr_.rows(), columns = qr_.cols();
  tau_.setZero(columns);
  pivots_.resize(columns);
  for (Index k = 0; k < columns; ++k) {
    Index longest = k;
    S most = S(-1);
    for (Index j = k; j < columns; ++j) {
      const S square = qr_.col(j).tail(rows - k).squaredNorm();
      if (!(square > most)) continue;
      most = square;
      longest = j;
    }
    pivots_[k] = static_cast<int>(longest);
    if (longest != k) qr_.col(k).swap(qr_.col(longest));
    S* v = &qr_(k, k);
    if (!(most > LeastSquare<S>())) continue;
    const S length = sqrt(most);
    const S image = v[0] < S(0) ? length : -length;  // away from v[0]: no cancellation
    tau_[k] = (image - v[0]) / image;
    for (Index i = 1; i < rows - k; ++i) v[i] /= v[0] - image;
    v[0] = S(1);
    for (Index j = k + 1; j < columns; ++j) Reflect(v, tau_[k], rows - k, &qr_(k, j));
    v[0] = image;
  }
}

/// Returns true if a pair of columns was rotated: its cosine exceeded the round-off of a product of
/// columns, which grows as the root of their size.
template <class S>
bool SingularValues<S>::Sweep(bool vectors) {
  using std::abs;
  using std::sqrt;
  const S negligible = 4 * std::numeric_limits<S>::epsilon() * sqrt(S(W_.rows()));
  bool turned = false;
  for (Index p = 0; p < W_.cols(); ++p) {
    for (Index q = p + 1; q < W_.cols(); ++q) {
      if (squares_[p] < LeastSquare<S>() || squares_[q] < LeastSquare<S>()) continue;
      const S product = Product(W_, p, q);
      // also skips NaN
      if (!(abs(product) > negligible * sqrt(squares_[p]) * sqrt(squares_[q]))) continue;
      turned = true;
      Rotate(p, q, product, vectors);
    }
  }
  return turned;
}

template <class S>
void SingularValues<S>::Rotate(Index p, Index q, const S& product, bool vectors) {
  using std::abs;
  using std::sqrt;
  const S zeta = (squares_[q] - squares_[p]) / (2 * product);
  const S size = abs(zeta);
  // the root is |zeta| where its square would be too large a number
  const S root = size * std::numeric_limits<S>::epsilon() > S(1) ? size : sqrt(1 + zeta * zeta);
  const S t = (zeta < S(0) ? S(-1) : S(1)) / (size + root);
  const S c = 1 / sqrt(1 + t * t), s = c * t;
  const Eigen::JacobiRotation<S> rotation(c, s);  // columns p and q times [c s; -s c]
  W_.applyOnTheRight(p, q, rotation);
  if (vectors) J_.applyOnTheRight(p, q, rotation);
  squares_[p] = Product(W_, p, p);
  squares_[q] = Product(W_, q, q);
}

template <class S>
void SingularValues<S>::Sort(bool vectors) {
  using std::sqrt;
  const Index size = W_.cols();
  sigma_.resize(size);
  for (Index j = 0; j < size; ++j) {
    sigma_[j] = squares_[j] < LeastSquare<S>() ? S(0) : S(sqrt(squares_[j]));
  }
  for (Index i = 0; i < size; ++i) {
    Index largest = i;
    for (Index j = i + 1; j < size; ++j) {
      if (sigma_[j] > sigma_[largest]) largest = j;
    }
    if (largest == i) continue;
    std::swap(sigma_[i], sigma_[largest]);
    if (!vectors) continue;
    W_.col(i).swap(W_.col(largest));
    J_.col(i).swap(J_.col(largest));
  }
}

template <class S>
void SingularValues<S>::Complete(Index first) {
  using std::sqrt;
  const Index size = W_.cols();
  for (Index j = first; j < size; ++j) {
    // the axis that lies furthest out of the columns so far
    Index axis = 0;
    S least = S(2);
    for (Index i = 0; i < size; ++i) {
      const S within = W_.row(i).head(j).squaredNorm();
      if (!(within < least)) continue;
      least = within;
      axis = i;
    }
    W_.col(j).setZero();
    W_(axis, j) = S(1);
    for (int twice = 0; twice < 2; ++twice) {
      for (Index i = 0; i < j; ++i) {
        const S along = Product(W_, i, j);
        for (Index r = 0; r < size; ++r) W_(r, j) -= along * W_(r, i);
      }
    }
    W_.col(j) /= S(sqrt(Product(W_, j, j)));
  }
}

template <class S>
void SingularValues<S>::Assemble() {
  const Index rows = qr_.rows(), size = qr_.cols();
  Index rank = 0;
  while (rank < size && !(sigma_[rank] == S(0))) ++rank;
  for (Index j = 0; j < rank; ++j) W_.col(j) /= sigma_[j];
  Complete(rank);
  // P U': exchanges of rows, the last first
  right_ = W_;
  for (Index k = size - 1; k >= 0; --k) {
    if (pivots_[k] != k) right_.row(k).swap(right_.row(pivots_[k]));
  }
  // Q [J 0; 0 1]
  left_.setIdentity(rows, rows);
  for (Index j = 0; j < size; ++j) {
    for (Index i = 0; i < size; ++i) left_(i, j) = J_(i, j);
  }
  for (Index k = size - 1; k >= 0; --k) {
    S* v = &qr_(k, k);
    v[0] = S(1);
    for (Index j = 0; j < rows; ++j) Reflect(v, tau_[k], rows - k, &left_(k, j));
  }
}

#define LOOPBENCH_INSTANTIATE(S) template class SingularValues<S>;
LOOPBENCH_FOR_EACH_SCALAR(LOOPBENCH_INSTANTIATE)
#undef LOOPBENCH_INSTANTIATE

}  // namespace loopbench
