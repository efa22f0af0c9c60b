// Pins in the plane: constants and motion of their bodies, over T = double or Lanes.
//
// A pin has D = the two directions of a force, so zeta_ij is 2 x 2, and everything is in ground
// axes. A body pinned to Ground has a fixed point of reference (Link::mobility): no kernel depends
// on the case.
#pragma once

#include "odca/handles.h"

namespace loopbench::odca::pins {

inline constexpr int kRows = 2;  ///< of D of a pin

template <class T>
struct Vector2 {
  T x, y;

  friend Vector2 operator+(const Vector2& a, const Vector2& b) { return {a.x + b.x, a.y + b.y}; }
  friend Vector2 operator-(const Vector2& a, const Vector2& b) { return {a.x - b.x, a.y - b.y}; }
  friend Vector2 operator-(const Vector2& a) { return {-a.x, -a.y}; }
};

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

/// zeta of a body (1-4): with t = z x r, zeta_ij = 1/m + t_i t_j^T / I.
template <class T>
LOOPBENCH_INLINE Response<T, kRows> ResponseOf(const Link<T>& link, const TurnedLink<T>& at) {
  const T m = link.mobility;
  const Vector2<T>&r1 = at.r1, &r2 = at.r2;
  return {.zeta11 = {m + r1.y * r1.y, -(r1.x * r1.y), m + r1.x * r1.x},
          .zeta22 = {m + r2.y * r2.y, -(r2.x * r2.y), m + r2.x * r2.x},
          .zeta12 = {{m + r1.y * r2.y, -(r1.y * r2.x)}, {-(r1.x * r2.y), m + r1.x * r2.x}}};
}

/// Accelerations of handles without forces.
template <class T>
struct Free {
  T zeta13[kRows], zeta23[kRows];
};

/// zeta_i3 of a body (1-4): gravity, its angular acceleration about a pin on Ground, and the
/// centripetal -w^2 r_i.
///
/// At a cut joint A_Q - A_P = g = 2 w_P x v_rel (7), where v_rel is RelativeVelocity() or its
/// negative, as Q comes before or after. In the same way A_Q - A_P is the motion of the body before
/// it relative to this one, or the negative. In both cases that is 2 w_P x RelativeVelocity(),
/// which zeta13 includes. Changes of speeds remove RelativeVelocity().
template <Unknowns kUnknowns, class T>
LOOPBENCH_INLINE Free<T> FreeMotion(const Link<T>& link, const TurnedLink<T>& at, const T& speed) {
  if constexpr (kUnknowns == Unknowns::kSpeeds) {
    return {.zeta13 = {-at.gap_v.x, -at.gap_v.y}, .zeta23 = {T{}, T{}}};
  }
  const T a = at.alpha, w2 = speed * speed * link.radius;
  const Vector2<T>&r1 = at.r1, &r2 = at.r2;
  Vector2<T> zeta13 = {link.gx - a * r1.y - w2 * r1.x, link.gy + a * r1.x - w2 * r1.y};
  if constexpr (kUnknowns == Unknowns::kAccelerations) {
    zeta13 = zeta13 + Cross(at.gap_w + at.gap_w, at.gap_v);  // (7)
  }
  return {.zeta13 = {zeta13.x, zeta13.y},
          .zeta23 = {link.gx - a * r2.y - w2 * r2.x, link.gy + a * r2.x - w2 * r2.y}};
}

/// sqrt(I) times angular acceleration, or change of speed, once the forces or impulses on both
/// handles are known (1-4).
template <Unknowns kUnknowns, class T>
LOOPBENCH_INLINE T AngularAcceleration(const TurnedLink<T>& at, const T* F1, const T* F2) {
  const T moment = (at.r1.x * F1[1] - at.r1.y * F1[0]) + (at.r2.x * F2[1] - at.r2.y * F2[0]);
  return kUnknowns == Unknowns::kSpeeds ? moment : at.alpha + moment;
}

/// Multiplications and divisions of these functions, as tests/odca/short_cut_test.cpp counts them.
constexpr int kResponseWork = 10, kAngularAccelerationWork = 4;
constexpr int FreeMotionWork(Unknowns unknowns) {
  return unknowns == Unknowns::kSpeeds ? 0 : unknowns == Unknowns::kAccelerations ? 12 : 10;
}

}  // namespace loopbench::odca::pins
