// The paper's two-handle bodies and assemblies in space, for joints that are revolute: one kernel
// per printed formula, over T = double or Lanes (mechanism/algebra/lanes.h).
//
// A handle is a joint side that is still open, its rows projected on the joint's D: moments about
// the two axes normal to its own, and the three forces. Everything at a handle is in axes of its
// joint side; z is the joint's axis. So zeta_ij, here D_i^T zeta_ij D_j, is 5 x 5 and constant for
// a body. A joint's angle turns the pairs of rows x, y of the bodies before it (TurnInto()). Rows
// have the order
//
//   moment x, y,  force x, y, z      and, for all six components, moment z after them
//
//   A_1 = zeta11 F_1 + zeta12 F_2 + zeta13                                                (1)
//   A_2 = zeta21 F_1 + zeta22 F_2 + zeta23                                                (2)
//
// Accelerations are relative to gravity: bodies are weightless, and Ground accelerates upwards.
#pragma once

#include "odca/arm_motion.h"

namespace loopbench::odca::arms {

/// zeta of a body or an assembly: handle 1 is a revolute one, handle 2 has k rows.
template <class T, int k>
struct Response {
  Symmetric<T, kRows> zeta11;
  Symmetric<T, k> zeta22;
  T zeta12[kRows][k];
};

/// Constants of a body between two joints.
template <class T>
struct Link {
  Shape<T> shape;
  Response<T, kRows> response;
  /// Acceleration about the axis of handle i by forces on handle j: the sixth row of zeta_ij.
  T about11[kRows], about12[kRows], about21[kRows], about22[kRows];
};

/// An assembly with a handle 2 of k rows, its handle 1 being on Ground.
template <class T, int k = kRows>
struct OneHandle {
  Symmetric<T, k> zeta22;
  T zeta23[k];
};

/// X = L d L^T of a join; L has ones on its diagonal, which stores `inverse` 1 / d.
template <class T, int n = kRows>
struct Factors {
  Symmetric<T, n> L;

  /// v := L^-1 v.
  LOOPBENCH_INLINE void Forward(T* v, int stride = 1) const {
    LOOPBENCH_UNROLL
    for (int i = 1; i < n; ++i) {
      LOOPBENCH_UNROLL
      for (int j = 0; j < i; ++j) v[i * stride] = v[i * stride] - L(i, j) * v[j * stride];
    }
  }
  /// v := L^-T d^-1 v.
  LOOPBENCH_INLINE void Backward(T* v) const {
    LOOPBENCH_UNROLL
    for (int i = n - 1; i >= 0; --i) {
      v[i] = v[i] * L(i, i);
      LOOPBENCH_UNROLL
      for (int j = i + 1; j < n; ++j) v[i] = v[i] - L(j, i) * v[j];
    }
  }
};

/// Factors X in place (16). `slack` becomes negative if a pivot is negative.
template <class T, int n>
LOOPBENCH_INLINE void Factor(Factors<T, n>& X, T& slack) {
  Symmetric<T, n>& L = X.L;
  LOOPBENCH_UNROLL
  for (int j = 0; j < n; ++j) {
    slack = Min(slack, L(j, j));
    const T inverse = 1.0 / L(j, j);
    L(j, j) = inverse;
    T column[n];
    LOOPBENCH_UNROLL
    for (int i = j + 1; i < n; ++i) {
      column[i] = L(i, j);
      L(i, j) = column[i] * inverse;
    }
    LOOPBENCH_UNROLL
    for (int i = j + 1; i < n; ++i) {
      LOOPBENCH_UNROLL
      for (int l = j + 1; l <= i; ++l) L(i, l) = L(i, l) - L(i, j) * column[l];
    }
  }
}

/// Data of a join for the downward pass: the force in it, on handle 1 of the second assembly, is
/// L^-T d^-1 (y - W F_2), with W = L^-1 zeta12 and y = L^-1 (zeta23 - zeta13) of the two (17, 21).
template <class T, int k = kRows>
struct EndCut {
  Factors<T> X;
  T W[kRows][k], y[kRows];
};
/// And L^-T d^-1 (U F_1 + y - L^-1 zeta12 F_2) if the first one has a handle 1, U = L^-1 zeta21 of
/// it. Long arms stream these through the cache, so there is no W.
template <class T>
struct Cut {
  Factors<T> X;
  T U[kRows][kRows], y[kRows];
};

/// The part that all joins have in common, A's handle 2 being turned already: X, W and y of the
/// cut, and handle 2 of the joint assembly.
template <class T, int k>
LOOPBENCH_INLINE void JoinEnd(const Symmetric<T, kRows>& zeta22_A, const T* zeta23_A,
                              const Response<T, k>& B, const T* zeta13_B, const T* zeta23_B,
                              Factors<T>& X, T (&W)[kRows][k], T (&y)[kRows],
                              Symmetric<T, k>& zeta22, T* zeta23, T& slack) {
  LOOPBENCH_UNROLL
  for (int i = 0; i < kRows * (kRows + 1) / 2; ++i) {
    X.L.at[i] = zeta22_A.at[i] + B.zeta11.at[i];  // (16)
  }
  Factor(X, slack);
  LOOPBENCH_UNROLL
  for (int i = 0; i < kRows; ++i) {
    y[i] = zeta23_A[i] - zeta13_B[i];  // (21)
    LOOPBENCH_UNROLL
    for (int j = 0; j < k; ++j) W[i][j] = B.zeta12[i][j];
  }
  X.Forward(y);
  LOOPBENCH_UNROLL
  for (int j = 0; j < k; ++j) X.Forward(&W[0][j], k);
  LOOPBENCH_UNROLL
  for (int i = 0; i < k; ++i) {
    T column[kRows], sum = zeta23_B[i];  // of d^-1 W
    LOOPBENCH_UNROLL
    for (int l = 0; l < kRows; ++l) {
      column[l] = X.L(l, l) * W[l][i];
      sum = sum + column[l] * y[l];
    }
    zeta23[i] = sum;  // (30)
    LOOPBENCH_UNROLL
    for (int j = 0; j <= i; ++j) {
      T entry = B.zeta22(i, j);
      LOOPBENCH_UNROLL
      for (int l = 0; l < kRows; ++l) entry = entry - column[l] * W[l][j];
      zeta22(i, j) = entry;  // (27)
    }
  }
}

/// A with nothing at its handle 1 and B by a revolute joint.
template <class T, int k>
LOOPBENCH_INLINE OneHandle<T, k> Join(OneHandle<T> A, const Turn<T>& turn, const Response<T, k>& B,
                                      const T* zeta13_B, const T* zeta23_B, EndCut<T, k>& cut,
                                      T& slack) {
  TurnHandle(turn, A.zeta22, A.zeta23);
  OneHandle<T, k> all;
  JoinEnd(A.zeta22, A.zeta23, B, zeta13_B, zeta23_B, cut.X, cut.W, cut.y, all.zeta22, all.zeta23,
          slack);
  return all;
}

template <class T, int k>
LOOPBENCH_INLINE void ForceIn(const EndCut<T, k>& cut, const T* F2, T* force) {
  LOOPBENCH_UNROLL
  for (int i = 0; i < kRows; ++i) {
    T sum = cut.y[i];
    LOOPBENCH_UNROLL
    for (int j = 0; j < k; ++j) sum = sum - cut.W[i][j] * F2[j];
    force[i] = sum;
  }
  cut.X.Backward(force);
}

/// A piece of an arm, both of its handles open.
template <class T>
struct Piece {
  Response<T, kRows> response;
  T zeta13[kRows], zeta23[kRows];
};

/// A := A and B by a revolute joint (16), (26-30).
template <class T>
LOOPBENCH_INLINE void Join(Piece<T>& A, const Turn<T>& turn, const Response<T, kRows>& B,
                           const Free<T>& free, Cut<T>& cut, T& slack) {
  Response<T, kRows>& own = A.response;
  TurnHandle(turn, own.zeta22, A.zeta23);
  LOOPBENCH_UNROLL
  for (int i = 0; i < kRows; ++i) {
    TurnPair(turn.c, turn.s, own.zeta12[i][0], own.zeta12[i][1]);
    TurnPair(turn.c, turn.s, own.zeta12[i][2], own.zeta12[i][3]);
    LOOPBENCH_UNROLL
    for (int j = 0; j < kRows; ++j) cut.U[j][i] = own.zeta12[i][j];
  }
  T W[kRows][kRows];
  JoinEnd(own.zeta22, A.zeta23, B, free.zeta13, free.zeta23, cut.X, W, cut.y, own.zeta22, A.zeta23,
          slack);
  LOOPBENCH_UNROLL
  for (int i = 0; i < kRows; ++i) cut.X.Forward(&cut.U[0][i], kRows);
  LOOPBENCH_UNROLL
  for (int i = 0; i < kRows; ++i) {
    T column[kRows], sum = A.zeta13[i];  // of d^-1 U
    LOOPBENCH_UNROLL
    for (int l = 0; l < kRows; ++l) {
      column[l] = cut.X.L(l, l) * cut.U[l][i];
      sum = sum - column[l] * cut.y[l];
    }
    A.zeta13[i] = sum;  // (29)
    LOOPBENCH_UNROLL
    for (int j = 0; j <= i; ++j) {
      T entry = own.zeta11(i, j);
      LOOPBENCH_UNROLL
      for (int l = 0; l < kRows; ++l) entry = entry - column[l] * cut.U[l][j];
      own.zeta11(i, j) = entry;  // (26)
    }
    LOOPBENCH_UNROLL
    for (int j = 0; j < kRows; ++j) {
      T entry = column[0] * W[0][j];
      LOOPBENCH_UNROLL
      for (int l = 1; l < kRows; ++l) entry = entry + column[l] * W[l][j];
      own.zeta12[i][j] = entry;  // (28)
    }
  }
}

/// `zeta12` belongs to the second assembly.
template <class T>
LOOPBENCH_INLINE void ForceIn(const Cut<T>& cut, const T (&zeta12)[kRows][kRows], const T* F1,
                              const T* F2, T* force) {
  LOOPBENCH_UNROLL
  for (int i = 0; i < kRows; ++i) {
    T sum = zeta12[i][0] * F2[0];
    LOOPBENCH_UNROLL
    for (int j = 1; j < kRows; ++j) sum = sum + zeta12[i][j] * F2[j];
    force[i] = sum;
  }
  cut.X.Forward(force);
  LOOPBENCH_UNROLL
  for (int i = 0; i < kRows; ++i) {
    T sum = cut.y[i] - force[i];
    LOOPBENCH_UNROLL
    for (int j = 0; j < kRows; ++j) sum = sum + cut.U[i][j] * F1[j];
    force[i] = sum;  // (17)
  }
  cut.X.Backward(force);
}

/// The force on handle 2 of the body before a joint, from that on handle 1 behind it.
template <class T>
LOOPBENCH_INLINE void OppositeBefore(const Turn<T>& turn, const T* force, T* F2) {
  LOOPBENCH_UNROLL
  for (int i = 0; i < 4; i += 2) {
    F2[i] = turn.s * force[i + 1] - turn.c * force[i];
    F2[i + 1] = -(turn.s * force[i] + turn.c * force[i + 1]);
  }
  F2[4] = -force[4];
}

/// Acceleration about the axis of a handle, or change of speed: `free` plus the forces' part (1-4).
template <class T, int k>
LOOPBENCH_INLINE T About(const T& free, const T (&by_1)[kRows], const T (&by_2)[k], const T* F1,
                         const T* F2) {
  T sum = free;
  LOOPBENCH_UNROLL
  for (int i = 0; i < kRows; ++i) sum = sum + by_1[i] * F1[i];
  LOOPBENCH_UNROLL
  for (int i = 0; i < k; ++i) sum = sum + by_2[i] * F2[i];
  return sum;
}

/// Multiplications and divisions of these functions, as tests/odca/arm_sweep_test.cpp counts them.
struct Operations {
  static constexpr int kJoin = 600, kForceIn = 75, kOpposite = 8;
  static constexpr int EndJoin(int k) { return 10 + 50 * k; }
  static constexpr int ForceInEnd(int k) { return 15 + 5 * k; }
  static constexpr int About(int k) { return kRows + k; }
};

}  // namespace loopbench::odca::arms
