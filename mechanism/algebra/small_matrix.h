// Vectors and matrices of a few numbers for kinematics: loops of a known length that the compiler
// unrolls. Eigen is for larger or run-time sizes: its expressions of small sizes took half of the
// compile time of the files that contain them.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <concepts>

#include "mechanism/algebra/known_size.h"

namespace loopbench {

/// The small functions run several times per body and evaluation; a call costs more than they do.
#define LOOPBENCH_INLINE [[gnu::always_inline]] inline

/// Matrix of rows x columns numbers, stored by columns. Not initialised by default.
template <class S, int rows, int columns = 1>
struct Small {
  static constexpr int kSize = rows * columns;
  using Copy = Eigen::Matrix<S, rows, columns>;
  S at[kSize];

  Small() = default;
  /// Takes all numbers, row by row.
  template <std::convertible_to<S>... Numbers>
  requires(sizeof...(Numbers) == kSize) LOOPBENCH_INLINE explicit(kSize == 1)
      Small(const Numbers&... numbers) {
    const S given[] = {S(numbers)...};
    LOOPBENCH_UNROLL
    for (int i = 0; i < kSize; ++i) at[i / columns + i % columns * rows] = given[i];
  }
  template <class Derived>
  Small(const Eigen::MatrixBase<Derived>& matrix) {  // of the same size
    Eigen::Map<Copy>{at} = matrix;
  }
  /// A copy that Eigen can work with.
  Copy eigen() const { return Eigen::Map<const Copy>(at); }

  static Small Zero() {
    Small zero;
    zero.setZero();
    return zero;
  }
  static Small Identity() {
    Small identity;
    identity.setIdentity();
    return identity;
  }
  static Small Unit(int i) {
    Small unit = Zero();
    unit[i] = S(1);
    return unit;
  }
  LOOPBENCH_INLINE void setZero() {
    LOOPBENCH_UNROLL
    for (int i = 0; i < kSize; ++i) at[i] = S(0);
  }
  LOOPBENCH_INLINE void setIdentity() {
    setZero();
    LOOPBENCH_UNROLL
    for (int i = 0; i < (rows < columns ? rows : columns); ++i) at[i + i * rows] = S(1);
  }

  S& operator[](int i) { return at[i]; }
  const S& operator[](int i) const { return at[i]; }
  S& operator()(int i, int j) { return at[i + j * rows]; }
  const S& operator()(int i, int j) const { return at[i + j * rows]; }
  /// The first n numbers, for vectors of a size known at run time.
  auto head(int n) { return Eigen::Map<Eigen::Matrix<S, Eigen::Dynamic, 1>>(at, n); }
  auto head(int n) const { return Eigen::Map<const Eigen::Matrix<S, Eigen::Dynamic, 1>>(at, n); }

  LOOPBENCH_INLINE Small<S, rows> col(int j) const {
    Small<S, rows> column;
    LOOPBENCH_UNROLL
    for (int i = 0; i < rows; ++i) column[i] = at[i + j * rows];
    return column;
  }
  LOOPBENCH_INLINE Small<S, columns, rows> transpose() const {
    Small<S, columns, rows> turned;
    LOOPBENCH_UNROLL
    for (int j = 0; j < columns; ++j) {
      LOOPBENCH_UNROLL
      for (int i = 0; i < rows; ++i) turned(j, i) = at[i + j * rows];
    }
    return turned;
  }
  template <class T>
  Small<T, rows, columns> cast() const {
    Small<T, rows, columns> other;
    for (int i = 0; i < kSize; ++i) other[i] = static_cast<T>(at[i]);
    return other;
  }

  LOOPBENCH_INLINE S dot(const Small& other) const {
    S sum = at[0] * other[0];
    LOOPBENCH_UNROLL
    for (int i = 1; i < kSize; ++i) sum += at[i] * other[i];
    return sum;
  }
  LOOPBENCH_INLINE Small cross(const Small& other) const {
    static_assert(kSize == 3);
    return {at[1] * other[2] - at[2] * other[1], at[2] * other[0] - at[0] * other[2],
            at[0] * other[1] - at[1] * other[0]};
  }
  LOOPBENCH_INLINE S squaredNorm() const { return dot(*this); }
  S norm() const {
    using std::sqrt;
    return sqrt(squaredNorm());
  }
  /// Returns true if all numbers are zero up to rounding, relative to one.
  bool isZero() const {
    using std::abs;
    for (const S& number : at) {
      if (abs(number) > S(1e-12)) return false;
    }
    return true;
  }
  /// Returns the vector scaled to length one; a zero vector stays zero.
  Small normalized() const {
    const S length = norm();
    return length > S(0) ? *this / length : *this;
  }

  LOOPBENCH_INLINE Small& operator+=(const Small& other) {
    LOOPBENCH_UNROLL
    for (int i = 0; i < kSize; ++i) at[i] += other[i];
    return *this;
  }
  LOOPBENCH_INLINE Small& operator-=(const Small& other) {
    LOOPBENCH_UNROLL
    for (int i = 0; i < kSize; ++i) at[i] -= other[i];
    return *this;
  }
  LOOPBENCH_INLINE Small& operator*=(const S& factor) {
    LOOPBENCH_UNROLL
    for (int i = 0; i < kSize; ++i) at[i] *= factor;
    return *this;
  }
  LOOPBENCH_INLINE Small& operator/=(const S& divisor) {
    LOOPBENCH_UNROLL
    for (int i = 0; i < kSize; ++i) at[i] /= divisor;
    return *this;
  }
  LOOPBENCH_INLINE friend Small operator+(Small a, const Small& b) { return a += b; }
  LOOPBENCH_INLINE friend Small operator-(Small a, const Small& b) { return a -= b; }
  LOOPBENCH_INLINE friend Small operator-(Small a) {
    LOOPBENCH_UNROLL
    for (int i = 0; i < kSize; ++i) a[i] = -a[i];
    return a;
  }
  LOOPBENCH_INLINE friend Small operator*(Small a, const S& factor) { return a *= factor; }
  LOOPBENCH_INLINE friend Small operator*(const S& factor, Small a) { return a *= factor; }
  LOOPBENCH_INLINE friend Small operator/(Small a, const S& divisor) { return a /= divisor; }
};

template <class S, int rows, int inner, int columns>
LOOPBENCH_INLINE Small<S, rows, columns> operator*(const Small<S, rows, inner>& A,
                                                   const Small<S, inner, columns>& B) {
  Small<S, rows, columns> product;
  const auto column = [&](int j) [[gnu::always_inline]] {
    LOOPBENCH_UNROLL
    for (int i = 0; i < rows; ++i) product(i, j) = A(i, 0) * B(0, j);
    LOOPBENCH_UNROLL
    for (int k = 1; k < inner; ++k) {
      LOOPBENCH_UNROLL
      for (int i = 0; i < rows; ++i) product(i, j) += A(i, k) * B(k, j);
    }
  };
  if constexpr (columns <= 3) {
    LOOPBENCH_UNROLL
    for (int j = 0; j < columns; ++j) column(j);
  } else {
    for (int j = 0; j < columns; ++j) column(j);
  }
  return product;
}

}  // namespace loopbench
