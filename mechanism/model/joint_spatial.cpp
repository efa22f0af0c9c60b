#include <algorithm>
#include <cmath>
#include <numbers>

#include "mechanism/algebra/instantiate.h"
#include "mechanism/model/joint_kinds.h"

namespace loopbench {

namespace {

template <class S>
struct Kinds {
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
    const int axes[] = {kAxes...};
    for (int i = 0; i < Spatial::kDim; ++i) {
      basis_F[i] = axes[i] == 0   ? Turn(tilt.about_x)
                   : axes[i] == 1 ? Turn(tilt.about_y)
                   : axes[i] == 2 ? Turn(tilt.z_M)
                                  : Direction<Spatial, S>::Zero();
      if (axes[i] > 2) basis_F[i][axes[i]] = length;
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

  /// The kind whose free directions are the first `kNumU` of these axes of F: turns (none, about z,
  /// or all), then shifts. A spherical joint is the paper's example: H = [1; 0], D = [0; 1] (8).
  template <int kNumU, int... kAxes>
  static JointKind<Spatial, S> Along() {
    static constexpr int kAxis[] = {kAxes...};
    static constexpr int kTurns = static_cast<int>(
        std::ranges::count_if(kAxis, kAxis + kNumU, [](int axis) { return axis < 3; }));
    static constexpr int kMore = kTurns == 3 ? 1 : 0;  // a quaternion has one number more
    static_assert(kTurns == 0 || (kTurns == 1 && kAxis[0] == 2) ||
                  (kTurns == 3 && kAxis[0] == 0 && kAxis[1] == 1 && kAxis[2] == 2));
    JointKind<Spatial, S> kind;
    kind.num_q = kNumU + kMore;
    kind.num_u = kNumU;
    kind.axes = {kAxes...};
    kind.rotation_invariant = kNumU == 0;
    kind.transform = [](const S* q, P& X, S) {
      if constexpr (kTurns == 0) X.R.setIdentity();
      if constexpr (kTurns == 1) TurnAboutZ(q[0], X);
      if constexpr (kTurns == 3) X.R = FromQuaternion(q);
      X.p.setZero();
      for (int i = kTurns; i < kNumU; ++i) X.p[kAxis[i] - 3] = q[i + kMore];
    };
    kind.coordinates = [](const P& X, S* q, S) {
      if constexpr (kTurns == 1) q[0] = AngleAboutZ(X);
      if constexpr (kTurns == 3) ToQuaternion(X.R, q);
      for (int i = kTurns; i < kNumU; ++i) q[i + kMore] = X.p[kAxis[i] - 3];
    };
    kind.rates = [](const S* q, const S* u, S* qdot) {
      if constexpr (kTurns == 3) QuaternionRates(q, u, qdot);
      for (int i = 3 * kMore; i < kNumU; ++i) qdot[i + kMore] = u[i];
    };
    if constexpr (kTurns == 1) {
      kind.exact_basis = TiltBasis<kAxes...>;
      kind.exact_bias = TiltBias;
      kind.exact_basis_rate = TiltRate<kAxes...>;
    }
    return kind;
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

}  // namespace

template <class S>
std::vector<JointKind<Spatial, S>> SpatialKinds() {
  using K = Kinds<S>;
  return {K::template Along<1, 2, 0, 1, 3, 4, 5>(),  // revolute
          K::template Along<1, 3, 0, 1, 2, 4, 5>(),  // prismatic
          K::template Along<0, 0, 1, 2, 3, 4, 5>(),  // weld
          K::template Along<6, 0, 1, 2, 3, 4, 5>(),  // free
          K::template Along<2, 2, 3, 0, 1, 4, 5>(),  // pin-in-slot
          K::Rod(),
          K::template Along<2, 2, 5, 0, 1, 3, 4>(),  // cylindrical
          K::template Along<3, 0, 1, 2, 3, 4, 5>(),  // spherical
          K::template Along<3, 2, 3, 4, 0, 1, 5>(),  // planar
          K::Universal(),
          K::Helical(),
          K::template Along<3, 3, 4, 5, 0, 1, 2>(),   // translation
          K::template Along<4, 2, 3, 4, 5, 0, 1>(),   // schoenflies
          K::template Along<4, 0, 1, 2, 3, 4, 5>(),   // point-on-line
          K::template Along<5, 0, 1, 2, 3, 4, 5>()};  // point-in-plane
}

#define LOOPBENCH_INSTANTIATE(S) template std::vector<JointKind<Spatial, S>> SpatialKinds();
LOOPBENCH_FOR_EACH_MODEL_SCALAR(LOOPBENCH_INSTANTIATE)
#undef LOOPBENCH_INSTANTIATE

}  // namespace loopbench
