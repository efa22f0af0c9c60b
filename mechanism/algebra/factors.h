// Eigen's factorisations of matrices of any size, compiled once per scalar for all users: each
// instantiation elsewhere costs seconds of compile time. For matrices of the types below in
// `compute` or the constructor.
#pragma once

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <Eigen/QR>

#include "mechanism/algebra/instantiate.h"
#include "mechanism/algebra/space.h"

/// Each of them for one scalar: declared with `extern`, defined without (factors.cpp).
// clang-format off
#define LOOPBENCH_FACTORS(EXTERN, S)                                                              \
  EXTERN template Eigen::Index                                                                    \
  Eigen::internal::llt_inplace<S, Eigen::Lower>::blocked(loopbench::MatrixX<S>&);                 \
  EXTERN template Eigen::Index                                                                    \
  Eigen::internal::llt_inplace<S, Eigen::Lower>::blocked(loopbench::JointMatrix<S>&);             \
  EXTERN template void Eigen::LLT<loopbench::MatrixX<S>>::solveInPlace(                           \
      const Eigen::MatrixBase<loopbench::VectorX<S>>&) const;                                     \
  EXTERN template class Eigen::PartialPivLU<loopbench::MatrixX<S>>;                               \
  EXTERN template class Eigen::ColPivHouseholderQR<loopbench::MatrixX<S>>;
// clang-format on
#define LOOPBENCH_DECLARE(S) LOOPBENCH_FACTORS(extern, S)
LOOPBENCH_FOR_EACH_SCALAR(LOOPBENCH_DECLARE)
#undef LOOPBENCH_DECLARE

namespace loopbench {

/// Eigen's LL^T. Eigen::LLT also computes a norm of the matrix, which only its rcond() needs. That
/// takes n^2 operations, and comparisons that would restrict where recorded code is valid
/// (harness/generate/graph.h).
template <class Matrix>
class CholeskyFactor : public Eigen::LLT<Matrix> {
 public:
  CholeskyFactor() = default;
  template <class Input>
  explicit CholeskyFactor(const Input& A) {
    compute(A);
  }

  template <class Input>
  CholeskyFactor& compute(const Input& A) {
    this->m_matrix = A;
    this->m_l1_norm = 0;  // unused
    this->m_isInitialized = true;
    this->m_info = InPlace(this->m_matrix) ? Eigen::Success : Eigen::NumericalIssue;
    return *this;
  }

  /// Overwrites the lower triangle of A by L. Returns false if A is not positive definite.
  static bool InPlace(Matrix& A) {
    return Eigen::internal::llt_inplace<typename Matrix::Scalar, Eigen::Lower>::blocked(A) == -1;
  }
};

}  // namespace loopbench
