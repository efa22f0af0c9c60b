// Revolute joints in space: constants and motion of their bodies, over T = double or Lanes.
//
// The rows of a handle are moments about the two axes normal to the joint's own, and the three
// forces, in axes of the joint side; z is the joint's axis. So zeta_ij is 5 x 5 and constant for a
// body. A joint's angle turns the pairs of rows x, y of the bodies before it (TurnInto()). Rows
// have the order
//
//   moment x, y,  force x, y, z      and, for all six components, moment z after them
//
// Accelerations are relative to gravity: bodies are weightless, and Ground accelerates upwards.
#pragma once

#include "mechanism/algebra/small_matrix.h"
#include "odca/handles.h"

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
template <class T>
LOOPBENCH_INLINE void TurnHandle(const Turn<T>& turn, OneHandle<T, kRows>& all) {
  TurnHandle(turn, all.zeta22, all.zeta23);
}
/// And zeta12.
template <class T>
LOOPBENCH_INLINE void TurnHandle(const Turn<T>& turn, TwoHandle<T, kRows>& all) {
  TurnHandle(turn, all.response.zeta22, all.zeta23);
  LOOPBENCH_UNROLL
  for (int i = 0; i < kRows; ++i) {
    TurnPair(turn.c, turn.s, all.response.zeta12[i][0], all.response.zeta12[i][1]);
    TurnPair(turn.c, turn.s, all.response.zeta12[i][2], all.response.zeta12[i][3]);
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

/// Constants of a body between two joints.
template <class T>
struct Link {
  Shape<T> shape;
  Response<T, kRows> response;
  /// Acceleration about the axis of handle i by forces on handle j: the sixth row of zeta_ij.
  T about11[kRows], about12[kRows], about21[kRows], about22[kRows];
};

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

/// Multiplications and divisions of these functions, as tests/odca/short_cut_test.cpp counts them.
constexpr int kTurnOneWork = 40, kTurnTwoWork = 80, kOppositeWork = 8;
constexpr int AboutWork(int k) { return kRows + k; }

}  // namespace loopbench::odca::arms
