// Singular values and vectors of small matrices by one-sided Jacobi rotations (Hestenes, J. SIAM 6
// (1958) 51), after a QR decomposition with pivoting (Drmac and Veselic, SIAM J. Matrix Anal. Appl.
// 29 (2008) 1322, 1343):
//
//   A P = Q R,   R^T J = W = U' Sigma,   A = (Q J) Sigma (P U')^T,
//
// where the rotations J make the columns of W orthogonal to each other. Columns are compared with
// their own lengths, not with the whole matrix. Small singular values of a graded matrix thus keep
// their digits; bidiagonal or two-sided methods lose them. In every scalar, in a separate source:
// Eigen's decompositions compile for half a minute per scalar.
#pragma once

#include "mechanism/algebra/space.h"

namespace loopbench {

template <class S>
class SingularValues {
 public:
  /// Computes A = U diag(sigma) V^T with U and V square and orthogonal, sigma descending and not
  /// negative. Allocates only if the shape of A has changed. Non-finite input yields non-finite
  /// output.
  void Compute(const MatrixX<S>& A);
  /// Does the same without U and V.
  void ComputeValues(const MatrixX<S>& A);

  const VectorX<S>& sigma() const { return sigma_; }  ///< min(rows, columns) of them
  const MatrixX<S>& U() const { return wide_ ? right_ : left_; }
  const MatrixX<S>& V() const { return wide_ ? left_ : right_; }

 private:
  void Decompose(const MatrixX<S>& A, bool vectors);
  /// qr_ = Q R by Householder's reflections I - tau v v^T, the longest remaining column first.
  void TriangulariseWithPivots();
  bool Sweep(bool vectors);
  void Rotate(Eigen::Index p, Eigen::Index q, const S& product, bool vectors);
  void Sort(bool vectors);
  /// The columns of W from `first`, which are zero, become unit vectors orthogonal to the others.
  void Complete(Eigen::Index first);
  void Assemble();

  bool wide_ = false;  ///< fewer rows than columns: A^T was decomposed
  MatrixX<S> qr_, W_, J_, left_, right_;
  VectorX<S> tau_, squares_, sigma_;
  Eigen::VectorXi pivots_;
};

}  // namespace loopbench
