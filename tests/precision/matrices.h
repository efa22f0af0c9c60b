// Matrices in every scalar, and how far they are from each other.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include "mechanism/algebra/space.h"

namespace loopbench {

template <class S>
MatrixX<S> Random(Eigen::Index rows, Eigen::Index columns, unsigned seed) {
  std::mt19937 generator(seed);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  MatrixX<S> A(rows, columns);
  for (Eigen::Index i = 0; i < A.size(); ++i) A.data()[i] = S(uniform(generator));
  return A;
}

/// By coefficients: Eigen's products of so many scalars take the compiler half a minute.
template <class S>
MatrixX<S> Times(const MatrixX<S>& A, const MatrixX<S>& B) {
  MatrixX<S> product(A.rows(), B.cols());
  for (Eigen::Index i = 0; i < A.rows(); ++i) {
    for (Eigen::Index j = 0; j < B.cols(); ++j) {
      product(i, j) = S(0);
      for (Eigen::Index k = 0; k < A.cols(); ++k) product(i, j) += A(i, k) * B(k, j);
    }
  }
  return product;
}

template <class S>
MatrixX<S> Scaled(const S& factor, MatrixX<S> A) {
  for (Eigen::Index i = 0; i < A.size(); ++i) A.data()[i] *= factor;
  return A;
}

/// The largest entry of |A - B|.
template <class S>
double Distance(const MatrixX<S>& A, const MatrixX<S>& B) {
  double largest = 0.0;
  for (Eigen::Index i = 0; i < A.size(); ++i) {
    using std::abs;
    largest = std::max(largest, static_cast<double>(abs(A.data()[i] - B.data()[i])));
  }
  return largest;
}

/// How far A^T A is from the identity, in eps.
template <class S>
double Skewness(const MatrixX<S>& A) {
  return Distance<S>(Times<S>(A.transpose(), A), MatrixX<S>::Identity(A.cols(), A.cols())) /
         static_cast<double>(std::numeric_limits<S>::epsilon());
}

}  // namespace loopbench
