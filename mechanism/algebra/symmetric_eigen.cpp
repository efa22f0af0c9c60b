#include "mechanism/algebra/symmetric_eigen.h"

#include <Eigen/Jacobi>
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "mechanism/algebra/instantiate.h"

namespace loopbench {

namespace {

using Index = Eigen::Index;

template <class S>
using Square = Eigen::Ref<MatrixX<S>>;
template <class S>
using Column = Eigen::Ref<VectorX<S>>;

/// A = Q T Q^T with T tridiagonal. Leaves T's diagonal in `diagonal` and its superdiagonal in
/// place. Below, column k has the v and A(k, k) the tau of its reflection I - tau v v^T of the rows
/// from k + 1 on. `work` has room for a column.
template <class S>
void MakeTridiagonal(Square<S> A, Column<S> diagonal, Column<S> work) {
  using std::sqrt;
  const Index n = A.rows();
  for (Index k = 0; k + 1 < n; ++k) {
    const Index size = n - k - 1;
    auto v = A.col(k).tail(size);
    const S first = v[0], square = v.tail(size - 1).squaredNorm();
    const S length = sqrt(first * first + square);
    const S image = first < S(0) ? length : S(-length);  // away from v[0]: no cancellation
    diagonal[k] = A(k, k);
    v[0] = S(1);
    if (!(square > std::numeric_limits<S>::min())) {
      A(k, k) = S(0);
      A(k, k + 1) = first;
      continue;
    }
    const S tau = (image - first) / image;
    A(k, k) = tau;
    A(k, k + 1) = image;
    v.tail(size - 1) /= first - image;
    auto rest = A.bottomRightCorner(size, size);
    auto w = work.head(size);
    w.noalias() = rest * v;
    w *= tau;
    w -= S(tau / 2 * w.dot(v)) * v;
    for (Index j = 0; j < size; ++j) rest.col(j) -= w[j] * v + v[j] * w;
  }
  diagonal[n - 1] = A(n - 1, n - 1);
}

/// The product of the reflections.
template <class S>
void FormQ(const Square<S>& A, Square<S> Q) {
  const Index n = A.rows();
  Q.setIdentity();
  for (Index k = n - 2; k >= 0; --k) {
    if (A(k, k) == S(0)) continue;
    const Index size = n - k - 1;
    const auto v = A.col(k).tail(size);
    for (Index j = k + 1; j < n; ++j) {
      auto column = Q.col(j).tail(size);
      column -= S(A(k, k) * v.dot(column)) * v;
    }
  }
}

/// The eigenvalue of [a b; b c] that is nearer to c (Wilkinson's shift).
template <class S>
S Shift(const S& a, const S& b, const S& c) {
  using std::abs;
  using std::sqrt;
  const S half = (a - c) / 2, root = sqrt(half * half + b * b);
  return c - b * b / (half + (half < S(0) ? S(-root) : root));
}

/// T := G^T T G and U := U G for a product G of rotations, which takes the shift's eigenvalue out
/// of rows `first` to `last` of T.
template <class S>
void QrStep(Column<S> d, Column<S> e, Index first, Index last, Square<S> U) {
  using std::sqrt;
  S x = d[first] - Shift(d[last - 1], e[last - 1], d[last]), z = e[first];
  for (Index k = first; k < last; ++k) {
    const S r = sqrt(x * x + z * z);
    if (!(r > S(0))) return;
    const S c = x / r, s = z / r;
    if (k > first) e[k - 1] = r;
    const S lower = d[k], between = e[k], upper = d[k + 1];
    const S mixed = 2 * c * s * between;
    d[k] = c * c * lower + mixed + s * s * upper;
    d[k + 1] = s * s * lower - mixed + c * c * upper;
    e[k] = c * s * (upper - lower) + (c * c - s * s) * between;
    x = e[k];
    if (k + 1 < last) {
      z = s * e[k + 1];
      e[k + 1] *= c;
    }
    U.applyOnTheRight(k, k + 1, Eigen::JacobiRotation<S>(c, S(-s)));
  }
}

/// Diagonalises T with diagonal d and off-diagonal e, with U := U G. Stops after thirty steps for
/// each eigenvalue; two are usual.
template <class S>
void Diagonalise(Column<S> d, Column<S> e, Square<S> U) {
  using std::abs;
  const auto is_split = [&](Index k) {
    return abs(e[k]) <= std::numeric_limits<S>::epsilon() * (abs(d[k]) + abs(d[k + 1])) ||
           abs(e[k]) <= std::numeric_limits<S>::min();
  };
  Index last = d.size() - 1;
  for (Index steps = 0; steps < 30 * d.size(); ++steps) {
    while (last > 0 && is_split(last - 1)) --last;
    if (last == 0) return;
    Index first = last - 1;
    while (first > 0 && !is_split(first - 1)) --first;
    QrStep<S>(d, e, first, last, U);
  }
}

}  // namespace

template <class S>
void SymmetricEigen(Square<S> A, Square<S> U, Column<S> lambda) {
  const Index n = A.rows();
  if (n == 0) return;
  const S scale = A.cwiseAbs().maxCoeff();  // squares shall not overflow
  if (scale > S(0)) A /= scale;
  MakeTridiagonal<S>(A, lambda, U.col(0));
  FormQ<S>(A, U);
  auto beside = A.col(0);  // the reflections are done with
  for (Index k = 0; k + 1 < n; ++k) beside[k] = A(k, k + 1);
  Diagonalise<S>(lambda, beside, U);
  lambda *= scale;
  for (Index i = 0; i < n; ++i) {
    Index smallest = i;
    for (Index k = i + 1; k < n; ++k) {
      if (lambda[k] < lambda[smallest]) smallest = k;
    }
    if (smallest == i) continue;
    std::swap(lambda[i], lambda[smallest]);
    U.col(i).swap(U.col(smallest));
  }
}

#define LOOPBENCH_INSTANTIATE(S) template void SymmetricEigen<S>(Square<S>, Square<S>, Column<S>);
LOOPBENCH_FOR_EACH_SCALAR(LOOPBENCH_INSTANTIATE)
#undef LOOPBENCH_INSTANTIATE

}  // namespace loopbench
