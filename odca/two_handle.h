// The paper's two-handle bodies and assemblies in the plane, for joints that are pins: one kernel
// per printed formula, over T = double or Lanes (mechanism/algebra/lanes.h).
//
// A handle is a joint side that is still open, its rows projected on the joint's D. A pin in the
// plane has D = the two directions of a force, so zeta_ij, here D_i^T zeta_ij D_j, is 2 x 2, and
// everything is in ground axes:
//
//   A_1 = zeta11 F_1 + zeta12 F_2 + zeta13                                                (1)
//   A_2 = zeta21 F_1 + zeta22 F_2 + zeta23                                                (2)
//
// A body pinned to Ground has a fixed point of reference (Link::mobility): no kernel depends on the
// case.
#pragma once

#include "odca/short_cut.h"

namespace loopbench::odca::pins {

template <class T>
struct Vector2 {
  T x, y;

  friend Vector2 operator+(const Vector2& a, const Vector2& b) { return {a.x + b.x, a.y + b.y}; }
  friend Vector2 operator-(const Vector2& a, const Vector2& b) { return {a.x - b.x, a.y - b.y}; }
  friend Vector2 operator-(const Vector2& a) { return {-a.x, -a.y}; }
};

/// [xx xy; yx yy].
template <class T>
struct Matrix2 {
  T xx, xy, yx, yy;

  friend Matrix2 operator-(const Matrix2& A, const Matrix2& B) {
    return {A.xx - B.xx, A.xy - B.xy, A.yx - B.yx, A.yy - B.yy};
  }
  friend Vector2<T> operator*(const Matrix2& A, const Vector2<T>& b) {
    return {A.xx * b.x + A.xy * b.y, A.yx * b.x + A.yy * b.y};
  }
};

/// A^T b.
template <class T>
LOOPBENCH_INLINE Vector2<T> TransposeTimes(const Matrix2<T>& A, const Vector2<T>& b) {
  return {A.xx * b.x + A.yx * b.y, A.xy * b.x + A.yy * b.y};
}

/// [xx xy; xy yy].
template <class T>
struct Symmetric2 {
  T xx, xy, yy;

  friend Symmetric2 operator+(const Symmetric2& A, const Symmetric2& B) {
    return {A.xx + B.xx, A.xy + B.xy, A.yy + B.yy};
  }
};

/// A B^T, the second factor being symmetric to it: Z - A^T B of a symmetric result.
template <class T>
LOOPBENCH_INLINE Symmetric2<T> MinusSymmetricProduct(const Symmetric2<T>& Z, const Matrix2<T>& A,
                                                     const Matrix2<T>& B) {
  return {Z.xx - (A.xx * B.xx + A.yx * B.yx), Z.xy - (A.xx * B.xy + A.yx * B.yy),
          Z.yy - (A.xy * B.xy + A.yy * B.yy)};
}

template <class T>
LOOPBENCH_INLINE Matrix2<T> Transpose(const Matrix2<T>& A) {
  return {A.xx, A.yx, A.xy, A.yy};
}

/// A^T B.
template <class T>
LOOPBENCH_INLINE Matrix2<T> TransposeTimes(const Matrix2<T>& A, const Matrix2<T>& B) {
  return {A.xx * B.xx + A.yx * B.yx, A.xx * B.xy + A.yx * B.yy, A.xy * B.xx + A.yy * B.yx,
          A.xy * B.xy + A.yy * B.yy};
}

/// Constants of a body between two pins. Its point of reference is the centre of mass, or its pin
/// on Ground. Arms lead from there to the handles, in axes fixed on the body with x towards handle
/// 1. They are divided by the radius sqrt(I), I being the inertia about that point [kg m^2]: then
/// (arm x force) is the angular acceleration times sqrt(I).
template <class T>
struct Link {
  T x1, x2, y2;    ///< arms (x1, 0) and (x2, y2) [1 / sqrt(kg)]
  T mobility;      ///< 1 / mass, 0 if the point of reference is fixed
  T gx, gy;        ///< its acceleration without forces of handles [m/s^2]
  T cosine, sine;  ///< sqrt(I) times angular acceleration by gravity: these times cos and sin
  T radius;        ///< sqrt(I)
  /// Least response across the joint at handle 1 [1 / kg], 0 if it closes no loop.
  T limit;
};

/// A body at one angle and speed: its arms in ground axes, divided by the radius, and sqrt(I) times
/// its angular acceleration without forces of handles.
template <class T>
struct TurnedLink {
  Vector2<T> r1, r2;
  T alpha;
  Vector2<T> gap_v;  ///< RelativeVelocity() in the joint at handle 1, if that is cut, else 0
  T gap_w;           ///< speed of its P, as in the line above
};

template <class T>
LOOPBENCH_INLINE TurnedLink<T> Turn(const Link<T>& link, const T& angle) {
  T s, c;
  SinCos(angle, s, c);
  return {.r1 = {link.x1 * c, link.x1 * s},
          .r2 = {link.x2 * c - link.y2 * s, link.x2 * s + link.y2 * c},
          .alpha = link.cosine * c + link.sine * s,
          .gap_v = {T{}, T{}},
          .gap_w = T{}};
}

/// z x r times w.
template <class T>
LOOPBENCH_INLINE Vector2<T> Cross(const T& w, const Vector2<T>& r) {
  return {-(w * r.y), w * r.x};
}
template <class T>
LOOPBENCH_INLINE Vector2<T> Scaled(const T& factor, const Vector2<T>& r) {
  return {factor * r.x, factor * r.y};
}

/// A point that is followed along a path, and its velocity.
template <class T>
struct Point {
  Vector2<T> p, v;

  friend Point operator+(const Point& a, const Point& b) { return {a.p + b.p, a.v + b.v}; }
  friend Point operator-(const Point& a, const Point& b) { return {a.p - b.p, a.v - b.v}; }
};

/// The point at handle 2, from that at handle 1.
template <class T>
LOOPBENCH_INLINE Point<T> Across(const Link<T>& link, const TurnedLink<T>& at, const T& speed,
                                 const Point<T>& from) {
  const Vector2<T> d = Scaled(link.radius, at.r2 - at.r1);
  return {from.p + d, from.v + Cross(speed, d)};
}

/// Loop data of a body: its tree pin to Ground, if any, and whether the joint to the body before it
/// is cut.
template <class T>
struct Closure {
  T follows;               ///< 1: the previous body sets handle 1, 0: pinned
  T pin_x, pin_y;          ///< the pin, if pinned
  T cut_here, cut_before;  ///< 1 if the joint is cut and its P is this body, the previous one
  T inverse_radius;        ///< of the Link
};

inline bool IsCut(const Closure<double>& closure) {
  return closure.cut_here + closure.cut_before > 0.0;
}

/// Handle 1 of a pinned body.
template <class T>
LOOPBENCH_INLINE Point<T> AtPin(const Link<T>& link, const TurnedLink<T>& at, const T& speed,
                                const Closure<T>& closure) {
  const Vector2<T> r = Scaled(link.radius, at.r1);
  return {{closure.pin_x + r.x, closure.pin_y + r.y}, Cross(speed, r)};
}

/// A cut joint with drift is imposed at one point of Q (joint.h); there the arm of P ends. `gap`
/// leads from the side on handle 1 of a body to the side on handle 2 of the body before it. At that
/// point their velocities differ by this value, whichever of them is P.
template <class T>
LOOPBENCH_INLINE Vector2<T> RelativeVelocity(const T& speed_P, const Point<T>& gap) {
  return gap.v - Cross(speed_P, gap.p);
}

/// zeta of a body or an assembly, and accelerations of its handles without forces.
template <class T>
struct TwoHandle {
  Symmetric2<T> zeta11, zeta22;
  Matrix2<T> zeta12;
  Vector2<T> zeta13, zeta23;
};

/// A leaf (1-4): with t = z x r, zeta_ij = 1/m + t_i t_j^T / I, and zeta_i3 is gravity, its angular
/// acceleration about a pin on Ground, and the centripetal -w^2 r_i.
///
/// At a cut joint A_Q - A_P = g = 2 w_P x v_rel (7), where v_rel is RelativeVelocity() or its
/// negative, as Q comes before or after. In the same way A_Q - A_P is the motion of the body before
/// it relative to this one, or the negative. In both cases that is 2 w_P x RelativeVelocity(),
/// which zeta13 includes. Changes of speeds remove RelativeVelocity().
template <Unknowns kUnknowns, class T>
LOOPBENCH_INLINE TwoHandle<T> Leaf(const Link<T>& link, const TurnedLink<T>& at, const T& speed) {
  const T m = link.mobility, a = at.alpha, w2 = speed * speed * link.radius;
  const Vector2<T>&r1 = at.r1, &r2 = at.r2;
  TwoHandle<T> leaf;
  leaf.zeta11 = {m + r1.y * r1.y, -(r1.x * r1.y), m + r1.x * r1.x};
  leaf.zeta22 = {m + r2.y * r2.y, -(r2.x * r2.y), m + r2.x * r2.x};
  leaf.zeta12 = {m + r1.y * r2.y, -(r1.y * r2.x), -(r1.x * r2.y), m + r1.x * r2.x};
  if constexpr (kUnknowns == Unknowns::kSpeeds) {
    leaf.zeta13 = -at.gap_v;
    leaf.zeta23 = {T{}, T{}};
  } else {
    leaf.zeta13 = {link.gx - a * r1.y - w2 * r1.x, link.gy + a * r1.x - w2 * r1.y};
    leaf.zeta23 = {link.gx - a * r2.y - w2 * r2.x, link.gy + a * r2.x - w2 * r2.y};
  }
  if constexpr (kUnknowns == Unknowns::kAccelerations) {
    leaf.zeta13 = leaf.zeta13 + Cross(at.gap_w + at.gap_w, at.gap_v);  // (7)
  }
  return leaf;
}

/// sqrt(I) times angular acceleration, or change of speed, once the forces or impulses on both
/// handles are known (1-4).
template <Unknowns kUnknowns, class T>
LOOPBENCH_INLINE T AngularAcceleration(const TurnedLink<T>& at, const Vector2<T>& F1,
                                       const Vector2<T>& F2) {
  const T moment = (at.r1.x * F1.y - at.r1.y * F1.x) + (at.r2.x * F2.y - at.r2.y * F2.x);
  return kUnknowns == Unknowns::kSpeeds ? moment : at.alpha + moment;
}

/// X = L D L^T of (16), by D^-1 and the l below L's ones; times b it is the solution of X x = b.
/// Its residuals are some round-offs of X for any condition, unlike cofactors over det: if a light
/// body hangs between heavy ones, their forces on it must be accurate to far more than its own
/// weight.
template <class T>
struct Factored2 {
  T first, l, second;

  Vector2<T> Solve(const T& x, const T& y) const {
    const T last = (y - l * x) * second;
    return {x * first - l * last, last};
  }
  friend Vector2<T> operator*(const Factored2& X, const Vector2<T>& b) { return X.Solve(b.x, b.y); }
  friend Matrix2<T> operator*(const Factored2& X, const Matrix2<T>& B) {
    const Vector2<T> left = X.Solve(B.xx, B.yx), right = X.Solve(B.xy, B.yy);
    return {left.x, right.x, left.y, right.y};
  }
};

/// Returns the factors of X. `slack` becomes negative if the smallest eigenvalue of X, which is at
/// least det / trace, is below `limit`: loop_solver.h then decides on the rank of the loop.
template <class T>
LOOPBENCH_INLINE Factored2<T> FactorsOf(const Symmetric2<T>& X, const T& limit, T& slack) {
  const T det = X.xx * X.yy - X.xy * X.xy;
  slack = Min(slack, det - limit * (X.xx + X.yy));
  const T inverse = 1.0 / (X.xx * det), first = det * inverse;
  return {first, X.xy * first, X.xx * X.xx * inverse};
}

/// Data of a series join for the downward pass: the force in it, on the second assembly at its
/// handle 1, is U F_1 - W F_2 + y (17).
template <class T>
struct Cut {
  Matrix2<T> U, W;
  Vector2<T> y;
};

/// Two assemblies by a pin between handle 2 of A and handle 1 of B.
template <class T>
LOOPBENCH_INLINE TwoHandle<T> Join(const TwoHandle<T>& A, const TwoHandle<T>& B, const T& limit,
                                   Cut<T>& cut, T& slack) {
  const Factored2<T> factors = FactorsOf(A.zeta22 + B.zeta11, limit, slack);  // (16)
  cut.U = factors * Transpose(A.zeta12);
  cut.W = factors * B.zeta12;
  cut.y = factors * (A.zeta23 - B.zeta13);                                        // (21)
  return {.zeta11 = MinusSymmetricProduct(A.zeta11, Transpose(A.zeta12), cut.U),  // (26)
          .zeta22 = MinusSymmetricProduct(B.zeta22, B.zeta12, cut.W),             // (27)
          .zeta12 = TransposeTimes(Transpose(A.zeta12), cut.W),                   // (28)
          .zeta13 = A.zeta13 - A.zeta12 * cut.y,                                  // (29)
          .zeta23 = B.zeta23 + TransposeTimes(B.zeta12, cut.y)};                  // (30)
}

template <class T>
LOOPBENCH_INLINE Vector2<T> ForceIn(const Cut<T>& cut, const Vector2<T>& F1, const Vector2<T>& F2) {
  return cut.U * F1 - cut.W * F2 + cut.y;  // (17)
}

/// An assembly with nothing at its handle 1: A_2 = zeta22 F_2 + zeta23.
template <class T>
struct OneHandle {
  Symmetric2<T> zeta22;
  Vector2<T> zeta23;
};

template <class T>
struct EndCut {
  Matrix2<T> W;
  Vector2<T> y;
};

/// Joins like Join(), for A without handle 1: also if A begins at Ground.
template <class T>
LOOPBENCH_INLINE OneHandle<T> Join(const OneHandle<T>& A, const TwoHandle<T>& B, const T& limit,
                                   EndCut<T>& cut, T& slack) {
  const Factored2<T> factors = FactorsOf(A.zeta22 + B.zeta11, limit, slack);
  cut.W = factors * B.zeta12;
  cut.y = factors * (A.zeta23 - B.zeta13);
  return {MinusSymmetricProduct(B.zeta22, B.zeta12, cut.W),
          B.zeta23 + TransposeTimes(B.zeta12, cut.y)};
}

template <class T>
LOOPBENCH_INLINE Vector2<T> ForceIn(const EndCut<T>& cut, const Vector2<T>& F2) {
  return cut.y - cut.W * F2;
}

/// Multiplications and divisions of these functions, as tests/odca/path_sweep_test.cpp counts them.
struct Operations {
  static constexpr int Leaf(Unknowns unknowns) {
    return unknowns == Unknowns::kSpeeds ? 12 : unknowns == Unknowns::kAccelerations ? 22 : 20;
  }
  static constexpr int kJoin = 57, kEndJoin = 31, kForceIn = 8, kForceInEnd = 4,
                       kAngularAcceleration = 4;
};

}  // namespace loopbench::odca::pins
