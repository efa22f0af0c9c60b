// Frames of model.h, composed.
#pragma once

#include <cmath>

#include "peers/model.h"

namespace loopbench::peers {

inline Matrix Transposed(const Matrix& R) {
  return {R[0], R[3], R[6], R[1], R[4], R[7], R[2], R[5], R[8]};
}
inline Vec Product(const Matrix& R, const Vec& v) {
  return {R[0] * v[0] + R[1] * v[1] + R[2] * v[2], R[3] * v[0] + R[4] * v[1] + R[5] * v[2],
          R[6] * v[0] + R[7] * v[1] + R[8] * v[2]};
}
inline Matrix Product(const Matrix& A, const Matrix& B) {
  Matrix product = {};
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      for (int k = 0; k < 3; ++k) product[3 * i + j] += A[3 * i + k] * B[3 * k + j];
    }
  }
  return product;
}
inline Vec Sum(const Vec& a, const Vec& b) { return {a[0] + b[0], a[1] + b[1], a[2] + b[2]}; }

/// A point given in the outer frame of X, in the inner one.
inline Vec SeenFrom(const Frame& X, const Vec& point) {
  const Vec way = {point[0] - X.p[0], point[1] - X.p[1], point[2] - X.p[2]};
  return Product(Transposed(X.R), way);
}
/// X_AC where both are given in the same axes: X_BA and X_BC.
inline Frame SeenFrom(const Frame& A, const Frame& C) {
  return {Product(Transposed(A.R), C.R), SeenFrom(A, C.p)};
}

}  // namespace loopbench::peers
