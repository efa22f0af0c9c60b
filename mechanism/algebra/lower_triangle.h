// Cholesky factors of matrices of a few rows, A = L L^T, for which Eigen's general forms have too
// much overhead. Storage is by columns; only lower triangles are read and written, and diagonals of
// L hold their reciprocals. The sizes 2, 4 and 5 are constants: rows of one or two planar pins and
// of one in space.
#pragma once

#include <algorithm>
#include <cmath>

#include "mechanism/algebra/known_size.h"

namespace loopbench {

/// Up to this size these loops are faster than Eigen's blocks.
inline constexpr int kSmallTriangle = 16;

/// L in A's place; returns the smallest pivot, the square of the smallest diagonal. Ends at a pivot
/// that is not positive, and returns that.
template <class S, class Size>
S FactorLower(S* A, Size size) {
  return WithSize<S, 2, 4, 5>(size, [=](auto n) {
    using std::min;
    using std::sqrt;
    S least = n > 0 ? A[0] : S(1);
    for (int j = 0; j < n; ++j) {
      S pivot = A[j + j * n];
      for (int k = 0; k < j; ++k) pivot -= A[j + k * n] * A[j + k * n];
      if (!(pivot > S(0))) return pivot;
      least = min(least, pivot);
      const S reciprocal = S(1) / sqrt(pivot);
      A[j + j * n] = reciprocal;
      for (int i = j + 1; i < n; ++i) {
        S value = A[i + j * n];
        for (int k = 0; k < j; ++k) value -= A[i + k * n] * A[j + k * n];
        A[i + j * n] = value * reciprocal;
      }
    }
    return least;
  });
}

/// x := L^-1 x, of numbers or vectors.
template <class S, class Size, class T>
void SolveLower(const S* L, Size size, T* x) {
  WithSize<S, 2, 4, 5>(size, [=](auto n) {
    for (int i = 0; i < n; ++i) {
      T value = x[i];
      for (int k = 0; k < i; ++k) value -= x[k] * L[i + k * n];
      x[i] = value * L[i + i * n];
    }
  });
}

/// x := L^-T x.
template <class S, class Size, class T>
void SolveLowerTransposed(const S* L, Size size, T* x) {
  WithSize<S, 2, 4, 5>(size, [=](auto n) {
    for (int i = n - 1; i >= 0; --i) {
      T value = x[i];
      for (int k = i + 1; k < n; ++k) value -= x[k] * L[k + i * n];
      x[i] = value * L[i + i * n];
    }
  });
}

/// Computes x := L x for a general L, such as an inverse.
template <class S>
void MultiplyLower(const S* L, int size, S* x) {
  WithSize<S, 2, 4, 5>(size, [=](auto n) {
    for (int r = n - 1; r >= 0; --r) {
      S sum = L[r + r * n] * x[r];
      for (int c = 0; c < r; ++c) sum += L[r + c * n] * x[c];
      x[r] = sum;
    }
  });
}

/// x := L^T x.
template <class S>
void MultiplyLowerTransposed(const S* L, int size, S* x) {
  WithSize<S, 2, 4, 5>(size, [=](auto n) {
    for (int c = 0; c < n; ++c) {
      S sum = S(0);
      for (int r = c; r < n; ++r) sum += L[r + c * n] * x[r];
      x[c] = sum;
    }
  });
}

/// Replaces L by L^-1, including its diagonal.
template <class S>
void InvertLower(S* L, int size) {
  WithSize<S, 2, 4, 5>(size, [=](auto n) {
    for (int j = 0; j < n; ++j) {
      for (int i = j + 1; i < n; ++i) {
        S sum = S(0);
        for (int k = j; k < i; ++k) sum += L[i + k * n] * L[k + j * n];
        L[i + j * n] = -sum * L[i + i * n];
      }
    }
  });
}

}  // namespace loopbench
