// A joint that Loopbench does not have: a wheel that rolls on a rack without slipping.
//
// Frame F lies on the rack, its x along the teeth; M is at the wheel's centre. The wheel turns by
// the angle q about z and moves by r q along x: the rolling radius r is the joint's parameter, with
// the sign of the side on which the rack is. In F axes, for motions [w; v],
//
//   H = [z; r x],   D = [0; y], [-r z; x] / sqrt(1 + r^2), [x; 0], [y; 0], [0; z],
//
// of which the plane has the first two. H and D are constant.
#pragma once

#include <cmath>
#include <numbers>

#include "mechanism/model/registry.h"

namespace own {

using namespace loopbench;

template <class Space, class S>
struct RackAndPinion {
  using X = Pose<Space, S>;

  static JointKind<Space, S> Make() {
    return {.num_q = 1,
            .num_u = 1,
            .axes = Axes(),
            .transform = Transform,
            .coordinates = Coordinate,
            .rates = [](const S*, const S* u, S* qdot) { qdot[0] = u[0]; },
            .basis = Directions};
  }

  /// After which components of [w; v] the columns of [H D] are called: that of the teeth after x.
  static std::array<int, Space::kDim> Axes() {
    if constexpr (Space::kRot == 1) {
      return {0, 2, 1};
    } else {
      return {2, 4, 3, 0, 1, 5};
    }
  }

  static void Transform(const S* q, X& X_FM, S r) {
    using std::cos;
    using std::sin;
    if constexpr (Space::kRot == 1) {
      X_FM.angle = q[0];
      X_FM.p = {r * q[0], S(0)};
    } else {
      const S c = cos(q[0]), s = sin(q[0]);
      X_FM.R = {c, -s, S(0), s, c, S(0), S(0), S(0), S(1)};
      X_FM.p = {r * q[0], S(0), S(0)};
    }
  }

  /// The angle of the wheel, in the turn that its place says.
  static void Coordinate(const X& X_FM, S* q, S r) {
    using std::atan2;
    using std::round;
    const S turn = S(2 * std::numbers::pi);
    q[0] = atan2(X_FM.R(1, 0), X_FM.R(0, 0));
    if (r != S(0)) q[0] += turn * round((X_FM.p[0] / r - q[0]) / turn);
  }

  static void Directions(const X&, Basis<Space, S>& basis_F, S r) {
    using std::sqrt;
    const S length = sqrt(S(1) + r * r);
    const int z = Space::kRot - 1;  // components of [w; v]: about z, along x and y
    const int x = Space::kRot, y = x + 1;
    const auto unit = [](int i) { return Direction<Space, S>::Unit(i); };
    basis_F[0] = unit(z) + unit(x) * r;
    basis_F[1] = unit(y);
    basis_F[2] = (unit(x) - unit(z) * r) / length;
    if constexpr (Space::kRot == 3) {
      basis_F[3] = unit(0);
      basis_F[4] = unit(1);
      basis_F[5] = unit(5);
    }
  }
};

inline JointType RegisterRackAndPinion() {
  return RegisterJoint<RackAndPinion>(
      {.name = "rack-and-pinion",
       .in_plane = true,
       .planar = "angle",
       .coordinates = "angle",
       .planar_axes = {"x", ""},
       .axes = {"zx", "z"},
       .parameter = {"radius", "the advance along the rack per angle [m/rad]", "m/rad"}});
}

}  // namespace own
