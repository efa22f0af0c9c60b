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

#include "mechanism/algebra/small_matrix.h"
#include "odca/short_cut.h"

namespace loopbench::odca::arms {

inline constexpr int kRows = 5;  ///< of D of a revolute joint
inline constexpr int kAll = 6;   ///< of a motion

template <class T>
using Vector3 = Small<T, 3>;
template <class T>
using Matrix3 = Small<T, 3, 3>;

/// Sine and cosine of a joint's angle.
template <class T>
struct Turn {
  T c, s;
};

/// Two components in axes behind the joint, from those before it.
template <class T>
LOOPBENCH_INLINE void TurnPair(const T& c, const T& s, T& x, T& y) {
  const T before = x;
  x = c * before + s * y;
  y = c * y - s * before;
}
template <class T>
LOOPBENCH_INLINE Vector3<T> TurnInto(const Turn<T>& turn, Vector3<T> v) {
  TurnPair(turn.c, turn.s, v[0], v[1]);
  return v;
}

/// Lower triangle, row by row.
template <class T, int n>
struct Symmetric {
  T at[n * (n + 1) / 2];

  /// j <= i.
  LOOPBENCH_INLINE const T& operator()(int i, int j) const { return at[i * (i + 1) / 2 + j]; }
  LOOPBENCH_INLINE T& operator()(int i, int j) { return at[i * (i + 1) / 2 + j]; }
};

/// zeta22 and zeta23 in axes behind the next joint. Turned from both sides, the parts of a 2 x 2
/// block that are symmetric without trace turn by twice the angle, and the others stay.
template <class T>
LOOPBENCH_INLINE void TurnHandle(const Turn<T>& turn, Symmetric<T, kRows>& zeta22, T* zeta23) {
  const T c2 = turn.c * turn.c - turn.s * turn.s, s2 = 2.0 * turn.c * turn.s;
  LOOPBENCH_UNROLL
  for (int i = 0; i < 4; i += 2) {
    const T mean = 0.5 * (zeta22(i, i) + zeta22(i + 1, i + 1));
    T half = 0.5 * (zeta22(i, i) - zeta22(i + 1, i + 1));
    TurnPair(c2, s2, half, zeta22(i + 1, i));
    zeta22(i, i) = mean + half;
    zeta22(i + 1, i + 1) = mean - half;
  }
  const T mean = 0.5 * (zeta22(2, 0) + zeta22(3, 1)), skew = 0.5 * (zeta22(2, 1) - zeta22(3, 0));
  T half = 0.5 * (zeta22(2, 0) - zeta22(3, 1)), both = 0.5 * (zeta22(2, 1) + zeta22(3, 0));
  TurnPair(c2, s2, half, both);
  zeta22(2, 0) = mean + half;
  zeta22(3, 1) = mean - half;
  zeta22(2, 1) = both + skew;
  zeta22(3, 0) = both - skew;
  LOOPBENCH_UNROLL
  for (int i = 0; i < 4; i += 2) {
    TurnPair(turn.c, turn.s, zeta22(4, i), zeta22(4, i + 1));
    TurnPair(turn.c, turn.s, zeta23[i], zeta23[i + 1]);
  }
}

/// Constants of a body's motion, in axes 1.
template <class T>
struct Shape {
  Matrix3<T> inertia, inverse;  ///< about the centre of mass [kg m^2]
  Vector3<T> r1, r2;            ///< sides 1 and 2 from the centre of mass [m]
  Matrix3<T> to_2;              ///< components in axes 2 from those in axes 1
};

/// Transform of quantities from the start of some bodies to their end.
template <class T>
struct Passage {
  Matrix3<T> R;  ///< components in axes 2 of the last one, from those in axes at the start
  Vector3<T> w;  ///< angular velocity against the start, in axes 2 of the last one
  Vector3<T> p;  ///< shift from the start to the last side 2, in axes at the start
  Vector3<T> v;  ///< velocity of that against the start, in axes 2 of the last one
};
template <class T>
LOOPBENCH_INLINE Passage<T> NoPassage() {
  Passage<T> none;
  LOOPBENCH_UNROLL
  for (int i = 0; i < 3; ++i) {
    none.w[i] = none.p[i] = none.v[i] = T{};
    LOOPBENCH_UNROLL
    for (int j = 0; j < 3; ++j) none.R(i, j) = T{} + (i == j ? 1.0 : 0.0);
  }
  return none;
}
/// Requested results of a passage: w, also R, or all.
enum class Follow { kSpeeds, kAxes, kPoints };

/// Adds one body, behind a joint of this turn and speed. Returns its angular velocity in axes 1.
template <Follow kFollow, class T>
LOOPBENCH_INLINE Vector3<T> Pass(const Shape<T>& body, const Turn<T>& turn, const T& speed,
                                 Passage<T>& along) {
  Vector3<T> w = TurnInto(turn, along.w);
  w[2] += speed;
  along.w = body.to_2 * w;
  if constexpr (kFollow != Follow::kSpeeds) {
    LOOPBENCH_UNROLL
    for (int j = 0; j < 3; ++j) TurnPair(turn.c, turn.s, along.R(0, j), along.R(1, j));
    if constexpr (kFollow == Follow::kPoints) {
      const Vector3<T> d = body.r2 - body.r1;
      along.p += along.R.transpose() * d;
      along.v = body.to_2 * (TurnInto(turn, along.v) + w.cross(d));
    }
    along.R = body.to_2 * along.R;
  }
  return w;
}
/// Concatenates two passages.
template <Follow kFollow, class T>
LOOPBENCH_INLINE void Pass(const Passage<T>& next, Passage<T>& along) {
  if constexpr (kFollow == Follow::kPoints) {
    along.v = next.R * (along.v + along.w.cross(next.p)) + next.v;
    along.p += along.R.transpose() * next.p;
  }
  along.w = next.R * along.w + next.w;
  if constexpr (kFollow != Follow::kSpeeds) along.R = next.R * along.R;
}

/// Accelerations of handles without forces: [angular x, y; linear x, y, z; angular z].
template <class T>
struct Free {
  T zeta13[kAll], zeta23[kAll];
};

/// zeta_i3 of a body (1-4): with alpha = -I^-1 (w x I w), side i has the angular acceleration alpha
/// and the linear one alpha x r_i + w x (w x r_i). Across the joint at side 1, A of this body less
/// A of the one before is H udot + g, g = [w x z u; 0] (7), whichever of them is P; it is counted
/// with zeta13. w is in axes 1.
template <Unknowns kUnknowns, class T>
LOOPBENCH_INLINE void FreeMotion(const Shape<T>& body, const Vector3<T>& w, const T& speed,
                                 Free<T>& free) {
  if constexpr (kUnknowns != Unknowns::kAccelerations) {
    free = Free<T>{};
    return;
  }
  const Vector3<T> alpha = body.inverse * (body.inertia * w).cross(w);
  const auto at = [&](const Vector3<T>& r) { return alpha.cross(r) + w.cross(w.cross(r)); };
  const Vector3<T> a1 = at(body.r1), alpha_2 = body.to_2 * alpha, a2 = body.to_2 * at(body.r2);
  free.zeta13[0] = alpha[0] - w[1] * speed;  // (7)
  free.zeta13[1] = alpha[1] + w[0] * speed;
  free.zeta23[0] = alpha_2[0];
  free.zeta23[1] = alpha_2[1];
  LOOPBENCH_UNROLL
  for (int i = 0; i < 3; ++i) {
    free.zeta13[2 + i] = a1[i];
    free.zeta23[2 + i] = a2[i];
  }
  free.zeta13[kRows] = alpha[2];
  free.zeta23[kRows] = alpha_2[2];
}

/// zeta of a body or an assembly: handle 1 is a revolute one, handle 2 has k rows.
template <class T, int k>
struct Response {
  Symmetric<T, kRows> zeta11;
  Symmetric<T, k> zeta22;
  T zeta12[kRows][k];
};

/// Force on a handle.
template <class T>
struct Force {
  T at[kRows];
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
