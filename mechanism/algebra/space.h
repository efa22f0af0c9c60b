// The plane and space as policies, so that every algorithm is written once (docs/decisions/001).
//
// Notation (docs/glossary.md): p_WB position of B's centre of mass from the ground origin, R_WB
// orientation of B, V = [w; v] velocity of a body at a point, F = [moment; force] at a point; all
// in ground axes unless the name has another suffix. In the plane w and moments have one component,
// in space three; "Dim" is the number of components of a motion: 3 or 6.
#pragma once

#include <Eigen/Core>
#include <cmath>

#include "mechanism/algebra/spatial_vector.h"

namespace loopbench {

struct Planar {
  static constexpr int kRot = 1;  ///< components of an angular velocity
  static constexpr int kLin = 2;  ///< components of a velocity
  static constexpr int kDim = 3;  ///< components of a motion [w; v]
};

struct Spatial {
  static constexpr int kRot = 3;
  static constexpr int kLin = 3;
  static constexpr int kDim = 6;
};

template <class S>
using VectorX = Eigen::Matrix<S, Eigen::Dynamic, 1>;
template <class S>
using MatrixX = Eigen::Matrix<S, Eigen::Dynamic, Eigen::Dynamic>;
/// Square matrix of one joint's rows; never on the heap.
template <class S>
using JointMatrix = Eigen::Matrix<S, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, 6, 6>;

/// Position and orientation of a frame. The planar angle is a number, not a class of numbers modulo
/// 2 pi: relative angles along and across loops need no unwrapping.
template <class Space, class S>
struct Pose;

template <class S>
struct Pose<Planar, S> {
  S angle = S(0);
  Rotation<Planar, S> R = Rotation<Planar, S>::Identity();
  Linear<Planar, S> p = Linear<Planar, S>::Zero();

  void SetAngle(S value) {
    using std::cos;
    using std::sin;
    angle = value;
    const S c = cos(value), s = sin(value);
    R = {c, -s, s, c};
  }
};

template <class S>
struct Pose<Spatial, S> {
  Rotation<Spatial, S> R = Rotation<Spatial, S>::Identity();
  Linear<Spatial, S> p = Linear<Spatial, S>::Zero();
};

/// X_AC = X_AB * X_BC. The matrix is the product of the two; `SetAngle` refreshes it from the
/// angle.
template <class S>
LOOPBENCH_INLINE Pose<Planar, S> Compose(const Pose<Planar, S>& X_AB, const Pose<Planar, S>& X_BC) {
  Pose<Planar, S> X;
  X.angle = X_AB.angle + X_BC.angle;
  X.R = X_AB.R * X_BC.R;
  X.p = X_AB.p + X_AB.R * X_BC.p;
  return X;
}
template <class S>
LOOPBENCH_INLINE Pose<Spatial, S> Compose(const Pose<Spatial, S>& X_AB,
                                          const Pose<Spatial, S>& X_BC) {
  return {X_AB.R * X_BC.R, X_AB.p + X_AB.R * X_BC.p};
}

/// X_BA from X_AB.
template <class S>
LOOPBENCH_INLINE Pose<Planar, S> Inverse(const Pose<Planar, S>& X_AB) {
  Pose<Planar, S> X;
  X.angle = -X_AB.angle;
  X.R = X_AB.R.transpose();
  X.p = -(X.R * X_AB.p);
  return X;
}
template <class S>
LOOPBENCH_INLINE Pose<Spatial, S> Inverse(const Pose<Spatial, S>& X_AB) {
  Pose<Spatial, S> X;
  X.R = X_AB.R.transpose();
  X.p = -(X.R * X_AB.p);
  return X;
}

/// Returns the orientation of a quaternion w x y z of any length; zero length gives the identity.
template <class S>
Rotation<Spatial, S> FromQuaternion(const S* q) {
  using std::sqrt;
  const S square = q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3];
  const S length = square > S(0) ? sqrt(square) : S(1);
  const S w = q[0] / length, x = q[1] / length, y = q[2] / length, z = q[3] / length;
  const S one = S(1), two = S(2);
  return {one - two * (y * y + z * z), two * (x * y - z * w),       two * (x * z + y * w),
          two * (x * y + z * w),       one - two * (x * x + z * z), two * (y * z - x * w),
          two * (x * z - y * w),       two * (y * z + x * w),       one - two * (x * x + y * y)};
}

/// A unit quaternion w x y z of an orientation, from its largest component (K. Shoemake, Animating
/// rotation with quaternion curves, SIGGRAPH 1985).
template <class S>
void ToQuaternion(const Rotation<Spatial, S>& R, S* q) {
  using std::sqrt;
  const S half = S(1) / S(2), trace = R(0, 0) + R(1, 1) + R(2, 2);
  if (trace > S(0)) {
    const S root = sqrt(trace + S(1)), t = half / root;
    q[0] = half * root;
    q[1] = (R(2, 1) - R(1, 2)) * t;
    q[2] = (R(0, 2) - R(2, 0)) * t;
    q[3] = (R(1, 0) - R(0, 1)) * t;
    return;
  }
  int i = R(1, 1) > R(0, 0) ? 1 : 0;
  if (R(2, 2) > R(i, i)) i = 2;
  const int j = (i + 1) % 3, k = (j + 1) % 3;
  const S root = sqrt(R(i, i) - R(j, j) - R(k, k) + S(1)), t = half / root;
  q[0] = (R(k, j) - R(j, k)) * t;
  q[1 + i] = half * root;
  q[1 + j] = (R(j, i) + R(i, j)) * t;
  q[1 + k] = (R(k, i) + R(i, k)) * t;
}

/// Rotation of a pose as a vector: angle (plane) or angle times axis, |.| <= pi (space).
template <class S>
Angular<Planar, S> RotationVector(const Pose<Planar, S>& X) {
  return Angular<Planar, S>(X.angle);
}
template <class S>
Angular<Spatial, S> RotationVector(const Pose<Spatial, S>& X) {
  using std::abs;
  using std::atan2;
  using std::sqrt;
  S half[4];  // cosine of half the angle, and its sine along the axis
  ToQuaternion(X.R, half);
  const Angular<Spatial, S> axis = {half[1], half[2], half[3]};
  const S cosine = abs(half[0]), sine = axis.norm();
  // their ratio is linear to round-off below sqrt(eps), and then has a derivative at zero too
  const bool tiny = sine * sine < S(Eigen::NumTraits<S>::epsilon());
  const S stretch = tiny ? S(2) / cosine : S(2) * atan2(sine, cosine) / sine;
  return (half[0] < S(0) ? S(-stretch) : stretch) * axis;
}

}  // namespace loopbench
