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
  EXTERN template Eigen::LLT<loopbench::MatrixX<S>>&                                              \
  Eigen::LLT<loopbench::MatrixX<S>>::compute(const Eigen::EigenBase<loopbench::MatrixX<S>>&);     \
  EXTERN template Eigen::LLT<loopbench::MatrixX<S>>&                                              \
  Eigen::LLT<loopbench::MatrixX<S>>::compute(                                                     \
      const Eigen::EigenBase<Eigen::Block<loopbench::MatrixX<S>>>&);                              \
  EXTERN template Eigen::LLT<loopbench::MatrixX<S>>&                                              \
  Eigen::LLT<loopbench::MatrixX<S>>::compute(                                                     \
      const Eigen::EigenBase<Eigen::Ref<const loopbench::MatrixX<S>>>&);                          \
  EXTERN template void Eigen::LLT<loopbench::MatrixX<S>>::solveInPlace(                           \
      const Eigen::MatrixBase<loopbench::VectorX<S>>&) const;                                     \
  EXTERN template Eigen::LLT<loopbench::JointMatrix<S>>&                                          \
  Eigen::LLT<loopbench::JointMatrix<S>>::compute(                                                 \
      const Eigen::EigenBase<loopbench::JointMatrix<S>>&);                                        \
  EXTERN template class Eigen::PartialPivLU<loopbench::MatrixX<S>>;                               \
  EXTERN template class Eigen::ColPivHouseholderQR<loopbench::MatrixX<S>>;
// clang-format on
#define LOOPBENCH_DECLARE(S) LOOPBENCH_FACTORS(extern, S)
LOOPBENCH_FOR_EACH_SCALAR(LOOPBENCH_DECLARE)
#undef LOOPBENCH_DECLARE
