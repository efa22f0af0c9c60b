// The paper's two-handle bodies and assemblies: one kernel per printed formula, over T = double or
// Lanes (mechanism/algebra/lanes.h), for pins in the plane (pins.h) and revolute joints in space
// (revolutes.h).
//
// A handle is a joint side that is still open. Its rows are projected on the joint's D. So zeta_ij,
// here D_i^T zeta_ij D_j, has as many rows as D has columns: n at handle 1, k at handle 2.
//
//   A_1 = zeta11 F_1 + zeta12 F_2 + zeta13                                                (1)
//   A_2 = zeta21 F_1 + zeta22 F_2 + zeta23                                                (2)
#pragma once

#include "odca/short_cut.h"

/// Behind the parameters of a lambda: its captures must not go through memory.
#define LOOPBENCH_INLINED __attribute__((always_inline))

namespace loopbench::odca {

/// Lower triangle, row by row.
template <class T, int n>
struct Symmetric {
  T at[n * (n + 1) / 2];

  /// j <= i.
  LOOPBENCH_INLINE const T& operator()(int i, int j) const { return at[i * (i + 1) / 2 + j]; }
  LOOPBENCH_INLINE T& operator()(int i, int j) { return at[i * (i + 1) / 2 + j]; }
};

/// zeta of a body or an assembly.
template <class T, int n, int k = n>
struct Response {
  Symmetric<T, n> zeta11;
  Symmetric<T, k> zeta22;
  T zeta12[n][k];
};

/// A body or an assembly, both of its handles open.
template <class T, int n>
struct TwoHandle {
  Response<T, n> response;
  T zeta13[n], zeta23[n];
};

/// An assembly with nothing at its handle 1, or with Ground: A_2 = zeta22 F_2 + zeta23.
template <class T, int k>
struct OneHandle {
  Symmetric<T, k> zeta22;
  T zeta23[k];
};

/// Force on a handle.
template <class T, int n>
struct HandleForce {
  T at[n];
};

/// X = L d L^T of a join; L has ones on its diagonal, which stores 1 / d. Residuals of solutions
/// are some round-offs of X for any condition, unlike cofactors over det. A light body between
/// heavy ones needs that: forces on it must be accurate to far more than its own weight.
template <class T, int n>
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
  LOOPBENCH_INLINE void Backward(T* v, int stride = 1) const {
    LOOPBENCH_UNROLL
    for (int i = n - 1; i >= 0; --i) {
      v[i * stride] = v[i * stride] * L(i, i);
      LOOPBENCH_UNROLL
      for (int j = i + 1; j < n; ++j) v[i * stride] = v[i * stride] - L(j, i) * v[j * stride];
    }
  }
  /// v := X^-1 v.
  LOOPBENCH_INLINE void Solve(T* v) const {
    Forward(v);
    Backward(v);
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
/// Factors two rows with one division. `slack` becomes negative if the smallest eigenvalue of X,
/// which is at least det / trace, is below `limit`: loop_solver.h then decides on the rank.
template <class T>
LOOPBENCH_INLINE void Factor(Factors<T, 2>& X, const T& limit, T& slack) {
  const T xx = X.L(0, 0), xy = X.L(1, 0), yy = X.L(1, 1), det = xx * yy - xy * xy;
  slack = Min(slack, det - limit * (xx + yy));
  const T inverse = 1.0 / (xx * det), first = det * inverse;
  X.L = {first, xy * first, xx * xx * inverse};
}

/// Data of a join for the downward pass: the force in it, on handle 1 of the second assembly, is
/// L^-T d^-1 (y - W F_2), with W = L^-1 zeta12 and y = L^-1 (zeta23 - zeta13) of the two (17, 21).
/// Two rows have L^-T d^-1 in W, U and y: a shorter sequence of operations from force to force.
template <class T, int n, int k = n>
struct EndCut {
  T W[n][k], y[n];
  Factors<T, n> X;
};
/// And L^-T d^-1 (U F_1 + y - L^-1 zeta12 F_2) if the first one has a handle 1, U = L^-1 zeta21 of
/// it. Long chains stream these through the cache, so there is either X or W.
template <class T, int n>
struct InnerCut {
  T U[n][n], y[n];
  Factors<T, n> X;
};
template <class T>
struct InnerCut<T, 2> {
  T U[2][2], y[2], W[2][2];
};

/// The part that all joins have in common: X, W and y of the cut, and handle 2 of the joint
/// assembly. A's handle 2 is in the axes of B. Only two rows have a limit.
template <class T, int n, int k>
LOOPBENCH_INLINE void JoinEnd(const Symmetric<T, n>& zeta22_A, const T* zeta23_A,
                              const Response<T, n, k>& B, const T* zeta13_B, const T* zeta23_B,
                              const T& limit, Factors<T, n>& X, T (&W)[n][k], T (&y)[n],
                              Symmetric<T, k>& zeta22, T* zeta23, T& slack) {
  LOOPBENCH_UNROLL
  for (int i = 0; i < n; ++i) {
    LOOPBENCH_UNROLL
    for (int j = 0; j <= i; ++j) X.L(i, j) = zeta22_A(i, j) + B.zeta11(i, j);  // (16)
  }
  if constexpr (n == 2) {
    Factor(X, limit, slack);
  } else {
    Factor(X, slack);
  }
  LOOPBENCH_UNROLL
  for (int i = 0; i < n; ++i) {
    y[i] = zeta23_A[i] - zeta13_B[i];  // (21)
    LOOPBENCH_UNROLL
    for (int j = 0; j < k; ++j) W[i][j] = B.zeta12[i][j];
  }
  X.Forward(y);
  LOOPBENCH_UNROLL
  for (int j = 0; j < k; ++j) X.Forward(&W[0][j], k);
  LOOPBENCH_UNROLL
  for (int i = 0; i < k; ++i) {
    T column[n], sum = zeta23_B[i];  // of d^-1 W
    LOOPBENCH_UNROLL
    for (int l = 0; l < n; ++l) {
      column[l] = X.L(l, l) * W[l][i];
      sum = sum + column[l] * y[l];
    }
    zeta23[i] = sum;  // (30)
    LOOPBENCH_UNROLL
    for (int j = 0; j <= i; ++j) {
      T entry = B.zeta22(i, j);
      LOOPBENCH_UNROLL
      for (int l = 0; l < n; ++l) entry = entry - column[l] * W[l][j];
      zeta22(i, j) = entry;  // (27)
    }
  }
}

/// A := A and B, A with nothing or Ground at its handle 1.
template <class T, int n, int k>
LOOPBENCH_INLINE OneHandle<T, k> JoinSeries(const OneHandle<T, n>& A, const Response<T, n, k>& B,
                                            const T* zeta13_B, const T* zeta23_B, const T& limit,
                                            EndCut<T, n, k>& cut, T& slack) {
  OneHandle<T, k> all;
  JoinEnd(A.zeta22, A.zeta23, B, zeta13_B, zeta23_B, limit, cut.X, cut.W, cut.y, all.zeta22,
          all.zeta23, slack);
  if constexpr (n == 2) {
    cut.X.Backward(cut.y);
    LOOPBENCH_UNROLL
    for (int j = 0; j < k; ++j) cut.X.Backward(&cut.W[0][j], k);
  }
  return all;
}

/// A := A and B (16), (26-30).
template <class T, int n>
LOOPBENCH_INLINE void JoinSeries(TwoHandle<T, n>& A, const Response<T, n>& B, const T* zeta13_B,
                                 const T* zeta23_B, const T& limit, InnerCut<T, n>& cut, T& slack) {
  Response<T, n>& own = A.response;
  const auto join = [&](Factors<T, n>& X, T(&W)[n][n]) LOOPBENCH_INLINED {
    LOOPBENCH_UNROLL
    for (int i = 0; i < n; ++i) {
      LOOPBENCH_UNROLL
      for (int j = 0; j < n; ++j) cut.U[j][i] = own.zeta12[i][j];
    }
    JoinEnd(own.zeta22, A.zeta23, B, zeta13_B, zeta23_B, limit, X, W, cut.y, own.zeta22, A.zeta23,
            slack);
    LOOPBENCH_UNROLL
    for (int i = 0; i < n; ++i) X.Forward(&cut.U[0][i], n);
    LOOPBENCH_UNROLL
    for (int i = 0; i < n; ++i) {
      T column[n], sum = A.zeta13[i];  // of d^-1 U
      LOOPBENCH_UNROLL
      for (int l = 0; l < n; ++l) {
        column[l] = X.L(l, l) * cut.U[l][i];
        sum = sum - column[l] * cut.y[l];
      }
      A.zeta13[i] = sum;  // (29)
      LOOPBENCH_UNROLL
      for (int j = 0; j <= i; ++j) {
        T entry = own.zeta11(i, j);
        LOOPBENCH_UNROLL
        for (int l = 0; l < n; ++l) entry = entry - column[l] * cut.U[l][j];
        own.zeta11(i, j) = entry;  // (26)
      }
      LOOPBENCH_UNROLL
      for (int j = 0; j < n; ++j) {
        T entry = column[0] * W[0][j];
        LOOPBENCH_UNROLL
        for (int l = 1; l < n; ++l) entry = entry + column[l] * W[l][j];
        own.zeta12[i][j] = entry;  // (28)
      }
    }
  };
  if constexpr (n == 2) {
    Factors<T, n> X;
    join(X, cut.W);
    X.Backward(cut.y);
    LOOPBENCH_UNROLL
    for (int j = 0; j < n; ++j) {
      X.Backward(&cut.U[0][j], n);
      X.Backward(&cut.W[0][j], n);
    }
  } else {
    T W[n][n];
    join(cut.X, W);
  }
}

/// The force in a join (17).
template <class T, int n, int k>
LOOPBENCH_INLINE void ForceIn(const EndCut<T, n, k>& cut, const T* F2, T* force) {
  LOOPBENCH_UNROLL
  for (int i = 0; i < n; ++i) {
    T sum = cut.y[i];
    LOOPBENCH_UNROLL
    for (int j = 0; j < k; ++j) sum = sum - cut.W[i][j] * F2[j];
    force[i] = sum;
  }
  if constexpr (n != 2) cut.X.Backward(force);
}
/// `B` is the second assembly.
template <class T, int n>
LOOPBENCH_INLINE void ForceIn(const InnerCut<T, n>& cut, const Response<T, n>& B, const T* F1,
                              const T* F2, T* force) {
  const auto times = [&](const T(&M)[n][n]) LOOPBENCH_INLINED {
    LOOPBENCH_UNROLL
    for (int i = 0; i < n; ++i) {
      T sum = M[i][0] * F2[0];
      LOOPBENCH_UNROLL
      for (int j = 1; j < n; ++j) sum = sum + M[i][j] * F2[j];
      force[i] = sum;
    }
  };
  if constexpr (n == 2) {
    times(cut.W);
  } else {
    times(B.zeta12);
    cut.X.Forward(force);
  }
  LOOPBENCH_UNROLL
  for (int i = 0; i < n; ++i) {
    T sum = cut.y[i];
    LOOPBENCH_UNROLL
    for (int j = 0; j < n; ++j) sum = sum + cut.U[i][j] * F1[j];
    force[i] = sum - force[i];
  }
  if constexpr (n != 2) cut.X.Backward(force);
}

/// Multiplications and divisions of these functions, as tests/odca/short_cut_test.cpp counts them.
template <int n>
struct Operations {
  static constexpr int kTriangle = n * (n - 1) / 2;
  static constexpr int kFactor = n == 2 ? 9 : n + kTriangle + (n - 1) * n * (n + 1) / 6;
  /// By Backward(), in the join or each time a force is found.
  static constexpr int kInJoin = n == 2 ? n + kTriangle : 0, kEach = n + kTriangle - kInJoin;
  static constexpr int EndJoin(int k) {
    return kFactor + (kTriangle + kInJoin) * (1 + k) + 2 * n * k + n * k * (k + 1) / 2;
  }
  static constexpr int kJoin =
      EndJoin(n) + n * (kTriangle + kInJoin) + 2 * n * n + n * n * (n + 1) / 2 + n * n * n;
  static constexpr int ForceInEnd(int k) { return n * k + kEach; }
  static constexpr int kForceIn = 2 * n * n + kEach + (n == 2 ? 0 : kTriangle);
};

}  // namespace loopbench::odca
