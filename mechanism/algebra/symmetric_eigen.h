// Eigenvalues and eigenvectors of a small symmetric matrix by cyclic Jacobi rotations (Golub and
// Van Loan, Matrix Computations, section 8.5). Eigen's own solver allocates in every call, which a
// right-hand side must not; and Jacobi's small eigenvalues are the more accurate ones.
#pragma once

#include <cmath>
#include <limits>
#include <utility>

#include "mechanism/algebra/space.h"

namespace loopbench {

/// A = U diag(lambda) U^T with lambda ascending. A is destroyed; all sizes must be set. About ten
/// sweeps of n^2 / 2 rotations, each O(n).
template <class S>
void SymmetricEigen(Eigen::Ref<MatrixX<S>> A, MatrixX<S>& U, VectorX<S>& lambda) {
  using std::abs;
  using std::sqrt;
  constexpr int kMaxSweeps = 50;  // convergence is quadratic: six to ten are usual
  const Eigen::Index n = A.rows();
  const S negligible = std::numeric_limits<S>::epsilon() * A.cwiseAbs().maxCoeff();
  U.setIdentity();
  bool rotated = true;
  for (int sweep = 0; sweep < kMaxSweeps && rotated; ++sweep) {
    rotated = false;
    for (Eigen::Index p = 0; p < n - 1; ++p) {
      for (Eigen::Index q = p + 1; q < n; ++q) {
        // what is below the round-off of its own diagonal, or of the whole matrix, stays
        if (abs(A(p, q)) <= negligible * std::numeric_limits<S>::epsilon() ||
            abs(A(p, q)) <= std::numeric_limits<S>::epsilon() * sqrt(abs(A(p, p) * A(q, q)))) {
          continue;
        }
        rotated = true;
        const S theta = (A(q, q) - A(p, p)) / (2 * A(p, q));
        const S t = (theta < S(0) ? S(-1) : S(1)) / (abs(theta) + sqrt(1 + theta * theta));
        const S c = 1 / sqrt(1 + t * t), s = t * c;
        for (Eigen::Index k = 0; k < n; ++k) {
          const S kp = A(k, p), kq = A(k, q);
          A(k, p) = c * kp - s * kq;
          A(k, q) = s * kp + c * kq;
        }
        for (Eigen::Index k = 0; k < n; ++k) {
          const S pk = A(p, k), qk = A(q, k);
          A(p, k) = c * pk - s * qk;
          A(q, k) = s * pk + c * qk;
          const S up = U(k, p), uq = U(k, q);
          U(k, p) = c * up - s * uq;
          U(k, q) = s * up + c * uq;
        }
      }
    }
  }
  lambda = A.diagonal();
  for (Eigen::Index i = 0; i < n; ++i) {
    Eigen::Index smallest = i;
    for (Eigen::Index k = i + 1; k < n; ++k) {
      if (lambda[k] < lambda[smallest]) smallest = k;
    }
    if (smallest == i) continue;
    std::swap(lambda[i], lambda[smallest]);
    for (Eigen::Index k = 0; k < n; ++k) std::swap(U(k, i), U(k, smallest));
  }
}

}  // namespace loopbench
