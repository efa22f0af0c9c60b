#include "mechanism/model/joint.h"

#include <algorithm>
#include <cmath>
#include <deque>
#include <numbers>
#include <stdexcept>
#include <string>

#include "mechanism/algebra/instantiate.h"

namespace loopbench {

namespace {

/// qdot = u, for kinds whose speeds are the rates of their coordinates.
template <class S, int n>
void SameRates(const S*, const S* u, S* qdot) {
  for (int i = 0; i < n; ++i) qdot[i] = u[i];
}

/// The distance |p| has the second derivative n . p'' + |v_t|^2 / |p|, v_t the part of v across n.
template <class Space, class S>
Acceleration<Space, S> RodBias(const Pose<Space, S>& X, const Velocity<Space, S>& V) {
  const S distance = X.p.norm();
  const Linear<Space, S> n = X.p / distance;
  const S across = (V.linear - n * n.dot(V.linear)).squaredNorm();
  return {Angular<Space, S>::Zero(), -n * (across / distance)};
}

/// Joints in space besides those of Along().
template <class S>
struct SpatialJoints {
  using P = Pose<Spatial, S>;

  static void TurnAboutZ(S angle, P& X) {
    using std::cos;
    using std::sin;
    const S c = cos(angle), s = sin(angle);
    X.R = {c, -s, S(0), s, c, S(0), S(0), S(0), S(1)};
  }
  static S AngleAboutZ(const P& X) {
    using std::atan2;
    return atan2(X.R(1, 0) - X.R(0, 1), X.R(0, 0) + X.R(1, 1));
  }
  /// The angular velocity is in F axes, hence the product from the left: e' = w e / 2.
  static void QuaternionRates(const S* q, const S* u, S* qdot) {
    const S half = S(1) / S(2);
    qdot[0] = half * (-u[0] * q[1] - u[1] * q[2] - u[2] * q[3]);
    qdot[1] = half * (u[0] * q[0] + u[1] * q[3] - u[2] * q[2]);
    qdot[2] = half * (-u[0] * q[3] + u[1] * q[0] + u[2] * q[1]);
    qdot[3] = half * (u[0] * q[2] - u[1] * q[1] + u[2] * q[0]);
  }
  /// The axes of a universal joint: x of F, y of M made normal to it, and the normal of both, about
  /// which it does not turn.
  struct Cross {
    Angular<Spatial, S> first, second, normal;
    explicit Cross(const P& X) : first(Angular<Spatial, S>::Unit(0)) {
      normal = first.cross(X.R.col(1)).normalized();
      second = normal.cross(first);
    }
  };
  static void CrossBasis(const P& X, Basis<Spatial, S>& basis_F, S) {
    const Cross axes(X);
    basis_F = Axes();
    basis_F[0] = Turn(axes.first);
    basis_F[1] = Turn(axes.second);
    basis_F[2] = Turn(axes.normal);
  }
  static Direction<Spatial, S> Turn(const Angular<Spatial, S>& axis) {
    return {axis, Linear<Spatial, S>::Zero()};
  }
  static Direction<Spatial, S> Shift(const Linear<Spatial, S>& axis) {
    return {Angular<Spatial, S>::Zero(), axis};
  }
  static Basis<Spatial, S> Axes() {
    Basis<Spatial, S> basis;
    for (int i = 0; i < Spatial::kDim; ++i) basis[i] = Direction<Spatial, S>::Unit(i);
    return basis;
  }
  /// Exact directions of a joint that turns about z. Its tilts -y_F . z_M and x_F . z_M have the
  /// rates (y_F x z_M) . w and (z_M x x_F) . w; no tilt changes by a turn about z_M.
  struct Tilt {
    Angular<Spatial, S> about_x, about_y, z_M;
    explicit Tilt(const Angular<Spatial, S>& z)
        : about_x(Angular<Spatial, S>::Unit(1).cross(z)),
          about_y(z.cross(Angular<Spatial, S>::Unit(0))),
          z_M(z) {}
  };
  /// [H D] of a kind with these `axes`, with exact tilts; other axes have this length. Linear in
  /// z_M and the length.
  template <int... kAxes>
  static void TiltAxes(const Angular<Spatial, S>& z_M, S length, Basis<Spatial, S>& basis_F) {
    const Tilt tilt(z_M);
    int i = 0;
    (SetTiltAxis<kAxes>(tilt, length, basis_F[i++]), ...);
  }
  template <int axis>
  LOOPBENCH_INLINE static void SetTiltAxis(const Tilt& tilt, const S& length,
                                           Direction<Spatial, S>& direction) {
    direction.setZero();
    if constexpr (axis == 0) {
      direction.angular = tilt.about_x;
    } else if constexpr (axis == 1) {
      direction.angular = tilt.about_y;
    } else if constexpr (axis == 2) {
      direction.angular = tilt.z_M;
    } else {
      direction.linear[axis - 3] = length;
    }
  }
  template <int... kAxes>
  static void TiltBasis(const P& X, Basis<Spatial, S>& basis_F, S) {
    TiltAxes<kAxes...>(X.R.col(2), S(1), basis_F);
  }
  template <int... kAxes>
  static void TiltRate(const P& X, const Velocity<Spatial, S>& V, Basis<Spatial, S>& rate_F) {
    TiltAxes<kAxes...>(V.angular.cross(X.R.col(2)), S(0), rate_F);
  }
  /// Second derivatives of the tilts, less the part that is linear in the accelerations: d/dt (y_F
  /// x z_M) . w = w^2 (y_F . z_M) - (w . z_M) (w . y_F), and the same about y.
  static Acceleration<Spatial, S> TiltBias(const P& X, const Velocity<Spatial, S>& V) {
    const Tilt tilt(X.R.col(2));
    const Angular<Spatial, S>& w = V.angular;
    const S square = w.dot(w), spin = w.dot(tilt.z_M);
    return {tilt.about_x * (spin * w[1] - square * tilt.z_M[1]) -
                tilt.about_y * (spin * w[0] - square * tilt.z_M[0]),
            Linear<Spatial, S>::Zero()};
  }

  static JointKind<Spatial, S> Universal() {
    return {.num_q = 2,
            .num_u = 2,
            .axes = {0, 1, 2, 3, 4, 5},
            .transform =
                [](const S* q, P& X, S) {
                  using std::cos;
                  using std::sin;
                  const S c = cos(q[0]), s = sin(q[0]), cy = cos(q[1]), sy = sin(q[1]);
                  X.R = {cy, S(0), sy, s * sy, c, -s * cy, -c * sy, s, c * cy};
                  X.p.setZero();
                },
            .coordinates =
                [](const P& X, S* q, S) {
                  using std::atan2;
                  q[0] = atan2(X.R(2, 1), X.R(1, 1));
                  q[1] = atan2(X.R(0, 2), X.R(0, 0));
                },
            .rates = SameRates<S, 2>,
            .basis = CrossBasis,
            // the second axis turns about the first: d/dt y' = u0 (x cross y')
            .bias =
                [](const P& X, const Velocity<Spatial, S>& V) {
                  const Cross axes(X);
                  const S turn = axes.first.dot(V.angular) * axes.second.dot(V.angular);
                  return Acceleration<Spatial, S>(turn * axes.normal, Linear<Spatial, S>::Zero());
                },
            .exact_basis = CrossBasis,
            // d/dt (x_F x y_M) . w = w^2 (x_F . y_M) - (w . y_M) (w . x_F)
            .exact_bias =
                [](const P& X, const Velocity<Spatial, S>& V) {
                  const Angular<Spatial, S>& w = V.angular;
                  const S rate = w.dot(X.R.col(1)) * w[0] - w.dot(w) * X.R.col(1)[0];
                  return Acceleration<Spatial, S>(rate * Cross(X).normal,
                                                  Linear<Spatial, S>::Zero());
                }};
  }

  static JointKind<Spatial, S> Rod() {
    return {.num_q = 0,
            .num_u = 5,
            .axes = {0, 1, 2, 3, 4, 5},
            .basis =
                [](const P& X, Basis<Spatial, S>& basis_F, S) {
                  const Linear<Spatial, S> n = X.p.normalized();
                  // from the coordinate axis that is farthest from n
                  using std::abs;
                  int least = abs(n[1]) < abs(n[0]) ? 1 : 0;
                  if (abs(n[2]) < abs(n[least])) least = 2;
                  const Linear<Spatial, S> across =
                      Linear<Spatial, S>::Unit(least).cross(n).normalized();
                  basis_F = Axes();
                  basis_F[3] = Shift(across);
                  basis_F[4] = Shift(n.cross(across));
                  basis_F[5] = Shift(n);
                },
            .bias = RodBias<Spatial, S>};
  }
  static JointKind<Spatial, S> Helical() {
    return {.num_q = 1,
            .num_u = 1,
            .axes = {2, 0, 1, 3, 4, 5},
            .transform =
                [](const S* q, P& X, S pitch) {
                  TurnAboutZ(q[0], X);
                  X.p = {S(0), S(0), pitch * q[0]};
                },
            .coordinates =
                [](const P& X, S* q, S pitch) {
                  // the shift along the axis determines the turn of the angle
                  using std::round;
                  const S turn = 2 * std::numbers::pi_v<S>;
                  q[0] = AngleAboutZ(X);
                  if (pitch != S(0)) q[0] += turn * round((X.p[2] / pitch - q[0]) / turn);
                },
            .rates = SameRates<S, 1>,
            .basis =
                [](const P&, Basis<Spatial, S>& basis_F, S pitch) {
                  using std::sqrt;
                  const S length = sqrt(S(1) + pitch * pitch);
                  const Linear<Spatial, S> z = Linear<Spatial, S>::Unit(2);
                  basis_F[0] = {z, pitch * z};
                  for (int i = 0; i < 2; ++i) {
                    basis_F[1 + i] = Turn(Angular<Spatial, S>::Unit(i));
                    basis_F[3 + i] = Shift(Linear<Spatial, S>::Unit(i));
                  }
                  basis_F[5] = {-pitch / length * z, z / length};
                },
            .exact_basis =
                [](const P& X, Basis<Spatial, S>& basis_F, S pitch) {
                  using std::sqrt;
                  const S length = sqrt(S(1) + pitch * pitch);
                  const Linear<Spatial, S> z = Linear<Spatial, S>::Unit(2);
                  TiltBasis<2, 0, 1, 3, 4, 5>(X, basis_F, pitch);
                  basis_F[0].linear = pitch * z;
                  basis_F[5] = {-pitch / length * z, z / length};
                },
            .exact_bias = TiltBias,
            .exact_basis_rate = TiltRate<2, 0, 1, 3, 4, 5>};
  }
};

/// The kind whose free directions are the first `kNumU` of these axes of F: turns (none, about z,
/// or all), then shifts. A spherical joint is the paper's example: H = [1; 0], D = [0; 1] (8).
template <class Space, class S, int kNumU, int... kAxes>
JointKind<Space, S> Along() {
  static constexpr int kRot = Space::kRot, kAxis[] = {kAxes...};
  static constexpr int kTurns = static_cast<int>(
      std::ranges::count_if(kAxis, kAxis + kNumU, [](int axis) { return axis < kRot; }));
  static constexpr int kMore = kTurns == 3 ? 1 : 0;  // a quaternion has one number more
  static_assert(kTurns == 0 || (kTurns == 1 && kAxis[0] == kRot - 1) ||
                (kTurns == 3 && kAxis[0] == 0 && kAxis[1] == 1 && kAxis[2] == 2));
  using InSpace = SpatialJoints<S>;
  JointKind<Space, S> kind;
  kind.num_q = kNumU + kMore;
  kind.num_u = kNumU;
  kind.axes = {kAxes...};
  kind.rotation_invariant = kNumU == (kRot == 1 ? kTurns : 0);
  kind.transform = [](const S* q, Pose<Space, S>& X, S) {
    if constexpr (kRot == 1) {
      X.angle = kTurns == 1 ? q[0] : S(0);
    } else if constexpr (kTurns == 0) {
      X.R.setIdentity();
    } else if constexpr (kTurns == 1) {
      InSpace::TurnAboutZ(q[0], X);
    } else {
      X.R = FromQuaternion(q);
    }
    X.p.setZero();
    for (int i = kTurns; i < kNumU; ++i) X.p[kAxis[i] - kRot] = q[i + kMore];
  };
  kind.coordinates = [](const Pose<Space, S>& X, S* q, S) {
    if constexpr (kTurns == 1) {
      if constexpr (kRot == 1) {
        q[0] = X.angle;
      } else {
        q[0] = InSpace::AngleAboutZ(X);
      }
    }
    if constexpr (kTurns == 3) ToQuaternion(X.R, q);
    for (int i = kTurns; i < kNumU; ++i) q[i + kMore] = X.p[kAxis[i] - kRot];
  };
  kind.rates = [](const S* q, const S* u, S* qdot) {
    if constexpr (kTurns == 3) InSpace::QuaternionRates(q, u, qdot);
    for (int i = 3 * kMore; i < kNumU; ++i) qdot[i + kMore] = u[i];
  };
  if constexpr (kTurns == 1 && kRot == 3) {
    kind.exact_basis = InSpace::template TiltBasis<kAxes...>;
    kind.exact_bias = InSpace::TiltBias;
    kind.exact_basis_rate = InSpace::template TiltRate<kAxes...>;
  }
  return kind;
}

template <class S>
JointKind<Planar, S> PlanarRod() {
  return {.num_q = 0,
          .num_u = 2,
          .axes = {0, 1, 2},
          .basis =
              [](const Pose<Planar, S>& X, Basis<Planar, S>& basis_F, S) {
                const Linear<Planar, S> n = X.p.normalized();
                basis_F[0] = Direction<Planar, S>::Unit(0);
                basis_F[1] = {Angular<Planar, S>::Zero(), {-n[1], n[0]}};
                basis_F[2] = {Angular<Planar, S>::Zero(), n};
              },
          .bias = RodBias<Planar, S>};
}

/// All kinds, in the order of JointType. Those that do not exist in the plane have no functions
/// there, or no place behind the last.
template <class Space, class S>
std::deque<JointKind<Space, S>>& KindsOf() {
  if constexpr (Space::kRot == 1) {
    static std::deque<JointKind<Planar, S>> kinds = {Along<Planar, S, 1, 0, 1, 2>(),  // revolute
                                                     Along<Planar, S, 1, 1, 0, 2>(),  // prismatic
                                                     Along<Planar, S, 0, 0, 1, 2>(),  // weld
                                                     Along<Planar, S, 3, 0, 1, 2>(),  // free
                                                     Along<Planar, S, 2, 0, 1, 2>(),  // pin-in-slot
                                                     PlanarRod<S>()};
    return kinds;
  } else {
    static std::deque<JointKind<Spatial, S>> kinds = {
        Along<Spatial, S, 1, 2, 0, 1, 3, 4, 5>(),  // revolute
        Along<Spatial, S, 1, 3, 0, 1, 2, 4, 5>(),  // prismatic
        Along<Spatial, S, 0, 0, 1, 2, 3, 4, 5>(),  // weld
        Along<Spatial, S, 6, 0, 1, 2, 3, 4, 5>(),  // free
        Along<Spatial, S, 2, 2, 3, 0, 1, 4, 5>(),  // pin-in-slot
        SpatialJoints<S>::Rod(),
        Along<Spatial, S, 2, 2, 5, 0, 1, 3, 4>(),  // cylindrical
        Along<Spatial, S, 3, 0, 1, 2, 3, 4, 5>(),  // spherical
        Along<Spatial, S, 3, 2, 3, 4, 0, 1, 5>(),  // planar
        SpatialJoints<S>::Universal(),
        SpatialJoints<S>::Helical(),
        Along<Spatial, S, 3, 3, 4, 5, 0, 1, 2>(),   // translation
        Along<Spatial, S, 4, 2, 3, 4, 5, 0, 1>(),   // schoenflies
        Along<Spatial, S, 4, 0, 1, 2, 3, 4, 5>(),   // point-on-line
        Along<Spatial, S, 5, 0, 1, 2, 3, 4, 5>()};  // point-in-plane
    return kinds;
  }
}

/// A pose without special values.
template <class Space, class S>
Pose<Space, S> SomePose() {
  Pose<Space, S> X;
  if constexpr (Space::kRot == 1) {
    X.SetAngle(S(0.4));
  } else {
    const S q[] = {S(0.8), S(0.2), S(0.4), S(0.4)};
    X.R = FromQuaternion(q);
  }
  for (int i = 0; i < Space::kLin; ++i) X.p[i] = S(0.3) + S(0.2) * S(i);
  return X;
}

/// Columns of H are as long at every pose, and screws are screws at every pose.
template <class Space, class S>
void ExamineBasis(JointKind<Space, S>* kind) {
  for (const auto directions : {kind->exact_basis, kind->basis}) {
    if (directions == nullptr) continue;
    Basis<Space, S> basis;
    directions(SomePose<Space, S>(), basis, kind->parameter);
    for (int i = 0; i < Space::kDim; ++i) {
      const bool turns = kind->axes[i] < Space::kRot;
      if (turns ? !basis[i].linear.isZero() : !basis[i].angular.isZero()) kind->has_screws = true;
    }
    if (directions != kind->basis || kind->num_u == 0) continue;
    kind->inverse_H_squared = S(1) / basis[0].squaredNorm();
  }
}

}  // namespace

template <class Space, class S>
void AddKind(JointType type, const JointKind<Space, S>& kind) {
  KindsOf<Space, S>().resize(static_cast<std::size_t>(type));
  ExamineBasis(&KindsOf<Space, S>().emplace_back(kind));
}

template <class Space, class S>
const JointKind<Space, S>& KindOf(JointType type) {
  const auto index = static_cast<std::size_t>(type);
  const auto& kinds = KindsOf<Space, S>();
  if (index < kinds.size()) return kinds[index];
  throw std::invalid_argument("joints of kind \"" + std::string(ToString(type)) +
                              "\" do not exist here: not in a plane, or in double alone");
}

template <class Space, class S>
JointKind<Space, S> KindWith(JointType type, S parameter) {
  JointKind<Space, S> kind = KindOf<Space, S>(type);
  kind.parameter = parameter;
  ExamineBasis(&kind);
  return kind;
}

template <class Space, class S>
Velocity<Space, S> Mismatch(const JointKind<Space, S>& kind, const Pose<Space, S>& X_FM) {
  if (kind.coordinates == nullptr) {  // a rod: its excess length along itself
    return {Angular<Space, S>::Zero(), X_FM.p * (S(1) - kind.parameter / X_FM.p.norm())};
  }
  S q[7];
  kind.coordinates(X_FM, q, kind.parameter);
  const Pose<Space, S> nearest = PoseAt(kind, q);
  Velocity<Space, S> mismatch(RotationVector(Compose(X_FM, Inverse(nearest))), X_FM.p - nearest.p);
  // A loop may wind: planar angles along it then differ by whole turns, which are no violation.
  if constexpr (Space::kRot == 1) {
    using std::remainder;
    mismatch.angular[0] = remainder(mismatch.angular[0], S(2 * std::numbers::pi_v<S>));
  }
  return mismatch;
}

#define LOOPBENCH_INSTANTIATE(Space, S)                         \
  template void AddKind(JointType, const JointKind<Space, S>&); \
  template const JointKind<Space, S>& KindOf(JointType);        \
  template JointKind<Space, S> KindWith(JointType, S);          \
  template Velocity<Space, S> Mismatch(const JointKind<Space, S>&, const Pose<Space, S>&);
LOOPBENCH_FOR_EACH_SPACE_AND_MODEL_SCALAR(LOOPBENCH_INSTANTIATE)
#undef LOOPBENCH_INSTANTIATE

}  // namespace loopbench
