// The plane and space as policies, so that every algorithm is written once (docs/design.md D1).
//
// Notation (docs/glossary.md): p_WB position of B's centre of mass from the ground origin, R_WB
// orientation of B, V = [w; v] motion of a body at a point, F = [moment; force] at a point; all in
// ground axes unless the name says otherwise. In the plane w and moments have one component, in
// space three; "Dim" is the number of components of a motion: 3 or 6.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cmath>

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

/// The small functions below run several times per body and evaluation; a call costs more than they
/// do.
#define LOOPBENCH_INLINE [[gnu::always_inline]] inline

template <class S>
using VectorX = Eigen::Matrix<S, Eigen::Dynamic, 1>;
template <class S>
using MatrixX = Eigen::Matrix<S, Eigen::Dynamic, Eigen::Dynamic>;

template <class Space, class S>
using Angular = Eigen::Matrix<S, Space::kRot, 1>;
template <class Space, class S>
using Linear = Eigen::Matrix<S, Space::kLin, 1>;
/// Velocity [w; v] or acceleration [alpha; a] of a body at a point.
template <class Space, class S>
using Motion = Eigen::Matrix<S, Space::kDim, 1>;
/// [moment; force] on a body at a point. The same type as Motion, for the reader alone: the
/// compiler does not keep the two apart.
template <class Space, class S>
using Wrench = Eigen::Matrix<S, Space::kDim, 1>;
/// A number per direction of a joint, in the order of its D; those beyond the joint's own are zero.
/// Again the same type, with room for a joint that constrains all directions.
template <class Space, class S>
using Components = Eigen::Matrix<S, Space::kDim, 1>;
/// Maps motions to forces or back.
template <class Space, class S>
using Block = Eigen::Matrix<S, Space::kDim, Space::kDim>;
/// Orientation matrix.
template <class Space, class S>
using Rotation = Eigen::Matrix<S, Space::kLin, Space::kLin>;

/// w x r.
template <class S>
LOOPBENCH_INLINE Eigen::Matrix<S, 2, 1> Cross(const Eigen::Matrix<S, 1, 1>& w,
                                              const Eigen::Matrix<S, 2, 1>& r) {
  return {-w[0] * r[1], w[0] * r[0]};
}
template <class S>
LOOPBENCH_INLINE Eigen::Matrix<S, 3, 1> Cross(const Eigen::Matrix<S, 3, 1>& w,
                                              const Eigen::Matrix<S, 3, 1>& r) {
  return w.cross(r);
}

/// r x f, a moment.
template <class S>
LOOPBENCH_INLINE Eigen::Matrix<S, 1, 1> Moment(const Eigen::Matrix<S, 2, 1>& r,
                                               const Eigen::Matrix<S, 2, 1>& f) {
  return Eigen::Matrix<S, 1, 1>(r[0] * f[1] - r[1] * f[0]);
}
template <class S>
LOOPBENCH_INLINE Eigen::Matrix<S, 3, 1> Moment(const Eigen::Matrix<S, 3, 1>& r,
                                               const Eigen::Matrix<S, 3, 1>& f) {
  return r.cross(f);
}

/// a x b of two angular vectors: zero in the plane.
template <class S>
LOOPBENCH_INLINE Eigen::Matrix<S, 1, 1> CrossAngular(const Eigen::Matrix<S, 1, 1>&,
                                                     const Eigen::Matrix<S, 1, 1>&) {
  return Eigen::Matrix<S, 1, 1>::Zero();
}
template <class S>
LOOPBENCH_INLINE Eigen::Matrix<S, 3, 1> CrossAngular(const Eigen::Matrix<S, 3, 1>& a,
                                                     const Eigen::Matrix<S, 3, 1>& b) {
  return a.cross(b);
}

/// Motion of a body at c + r from its motion at c: [w; v + w x r].
template <class Space, class S>
LOOPBENCH_INLINE Motion<Space, S> ShiftMotion(const Motion<Space, S>& V,
                                              const Linear<Space, S>& r) {
  Motion<Space, S> shifted = V;
  const Angular<Space, S> w = V.template head<Space::kRot>();
  shifted.template tail<Space::kLin>() += Cross<S>(w, r);
  return shifted;
}

/// The same force at c instead of c + r: [moment + r x f; f]. The transpose of ShiftMotion().
template <class Space, class S>
LOOPBENCH_INLINE Wrench<Space, S> ShiftForce(const Wrench<Space, S>& F, const Linear<Space, S>& r) {
  Wrench<Space, S> shifted = F;
  const Linear<Space, S> f = F.template tail<Space::kLin>();
  shifted.template head<Space::kRot>() += Moment<S>(r, f);
  return shifted;
}

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
    R << c, -s, s, c;
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
  X.R.noalias() = X_AB.R * X_BC.R;
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

/// Rotation of a pose as a vector: angle (plane) or angle times axis, |.| <= pi (space).
template <class S>
Eigen::Matrix<S, 1, 1> RotationVector(const Pose<Planar, S>& X) {
  return Eigen::Matrix<S, 1, 1>(X.angle);
}
template <class S>
Eigen::Matrix<S, 3, 1> RotationVector(const Pose<Spatial, S>& X) {
  using std::abs;
  using std::atan2;
  using std::sqrt;
  const Eigen::Quaternion<S> half(X.R);  // cosine and sine of half the angle
  const S cosine = abs(half.w()), sine = sqrt(half.vec().squaredNorm());
  // their ratio is linear to round-off below sqrt(eps), and then has a derivative at zero too
  const bool tiny = sine * sine < S(Eigen::NumTraits<S>::epsilon());
  const S stretch = tiny ? S(2) / cosine : S(2) * atan2(sine, cosine) / sine;
  return (half.w() < S(0) ? S(-stretch) : stretch) * half.vec();
}

}  // namespace loopbench
