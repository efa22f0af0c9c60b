// Eigenvalues and eigenvectors of a symmetric matrix by Householder's tridiagonal form and implicit
// QR steps (Golub and Van Loan, Matrix Computations, 4th edition, sections 8.3.1 to 8.3.5). Eigen's
// own solver does the same, but allocates in every call, which a right-hand side must not, and
// takes the compiler five seconds for each scalar.
#pragma once

#include "mechanism/algebra/space.h"

namespace loopbench {

/// Computes A = U diag(lambda) U^T with lambda ascending, in about 9 n^3 operations. Errors are
/// round-off of the largest eigenvalue. A is destroyed; all sizes must be set. Non-finite input
/// yields non-finite output.
template <class S>
void SymmetricEigen(Eigen::Ref<MatrixX<S>> A, Eigen::Ref<MatrixX<S>> U,
                    Eigen::Ref<VectorX<S>> lambda);

/// The eigenvalues alone, with an allocation. Not in the source, which is also compiled for other
/// scalars: it would instantiate the double version there, with the options of those libraries.
inline VectorX<double> SymmetricEigenvalues(MatrixX<double> A) {
  MatrixX<double> U(A.rows(), A.rows());
  VectorX<double> lambda(A.rows());
  SymmetricEigen<double>(A, U, lambda);
  return lambda;
}

}  // namespace loopbench
