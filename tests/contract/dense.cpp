#include "tests/contract/dense.h"

#include <Eigen/Eigenvalues>
#include <utility>
#include <vector>

namespace loopbench::testing {

RealVector SolveFullPivot(RealMatrix A, RealVector b, Real zero) {
  const int n = static_cast<int>(A.rows());
  std::vector<int> unknown(n);
  for (int i = 0; i < n; ++i) unknown[i] = i;
  Real largest = 0;
  int rank = n;
  for (int k = 0; k < n; ++k) {
    int row = k, column = k;
    for (int j = k; j < n; ++j) {
      for (int i = k; i < n; ++i) {
        if (std::abs(A(i, j)) > std::abs(A(row, column))) row = i, column = j;
      }
    }
    if (k == 0) largest = std::abs(A(row, column));
    if (!(std::abs(A(row, column)) > zero * largest)) {
      rank = k;
      break;
    }
    A.row(k).swap(A.row(row));
    std::swap(b[k], b[row]);
    A.col(k).swap(A.col(column));
    std::swap(unknown[k], unknown[column]);
    for (int i = k + 1; i < n; ++i) A(i, k) /= A(k, k);
    for (int i = k + 1; i < n; ++i) b[i] -= A(i, k) * b[k];
    for (int j = k + 1; j < n; ++j) {
      for (int i = k + 1; i < n; ++i) A(i, j) -= A(i, k) * A(k, j);
    }
  }
  RealVector x = RealVector::Zero(n);
  for (int k = rank - 1; k >= 0; --k) {
    Real sum = b[k];
    for (int j = k + 1; j < rank; ++j) sum -= A(k, j) * x[unknown[j]];
    x[unknown[k]] = sum / A(k, k);
  }
  return x;
}

RealMatrix CholeskyFactor(const RealMatrix& A) {
  RealMatrix L = RealMatrix::Zero(A.rows(), A.cols());
  for (int j = 0; j < A.cols(); ++j) {
    for (int i = j; i < A.rows(); ++i) {
      Real sum = A(i, j);
      for (int k = 0; k < j; ++k) sum -= L(i, k) * L(j, k);
      L(i, j) = i == j ? std::sqrt(sum) : sum / L(j, j);
    }
  }
  return L;
}

RealMatrix SolveLower(const RealMatrix& L, RealMatrix B) {
  for (int c = 0; c < B.cols(); ++c) {
    for (int i = 0; i < B.rows(); ++i) {
      for (int k = 0; k < i; ++k) B(i, c) -= L(i, k) * B(k, c);
      B(i, c) /= L(i, i);
    }
  }
  return B;
}

RealVector SymmetricEigenvalues(const RealMatrix& A) {
  return Eigen::SelfAdjointEigenSolver<RealMatrix>(A, Eigen::EigenvaluesOnly).eigenvalues();
}

}  // namespace loopbench::testing
