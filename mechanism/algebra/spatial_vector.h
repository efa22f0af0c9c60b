// Velocities, accelerations and forces of bodies as pairs of an angular and a linear part, in the
// plane and in space. Each has its own type: meaningless operations do not compile.
#pragma once

#include "mechanism/algebra/small_matrix.h"

namespace loopbench {

template <class Space, class S>
using Angular = Small<S, Space::kRot>;
template <class Space, class S>
using Linear = Small<S, Space::kLin>;

/// Type tags of a pair. A direction, a column of a joint's H or D, becomes a velocity, an
/// acceleration or a force when multiplied with a speed, an acceleration or a force.
struct VelocityKind {};
struct AccelerationKind {};
struct ForceKind {};
struct DirectionKind {};

/// Pairs that shift like a velocity, and pairs that shift like a force.
template <class Kind>
concept KindOfMotion = !std::same_as<Kind, ForceKind>;
template <class Kind>
concept KindOfForce = std::same_as<Kind, ForceKind> || std::same_as<Kind, DirectionKind>;
/// Pairs with a product: a power, its like with an acceleration, or a component along a direction.
template <class A, class B>
concept HaveProduct = (KindOfForce<A> && KindOfMotion<B>) || (KindOfMotion<A> && KindOfForce<B>);

template <class Space, class S, class Kind>
struct SpatialVector {
  Angular<Space, S> angular;  ///< w, alpha or moment
  Linear<Space, S> linear;    ///< v, a or force; of or at a point that the context names

  SpatialVector() = default;
  LOOPBENCH_INLINE SpatialVector(const Angular<Space, S>& about, const Linear<Space, S>& along)
      : angular(about), linear(along) {}
  /// Converts a direction to any kind.
  template <std::same_as<DirectionKind> Other>
  LOOPBENCH_INLINE SpatialVector(const SpatialVector<Space, S, Other>& direction)
      : angular(direction.angular), linear(direction.linear) {}
  template <class Derived>
  explicit SpatialVector(const Eigen::MatrixBase<Derived>& vector)
      : angular(vector.template head<Space::kRot>()), linear(vector.template tail<Space::kLin>()) {}
  /// [angular; linear], a copy that Eigen can work with.
  Eigen::Matrix<S, Space::kDim, 1> eigen() const {
    Eigen::Matrix<S, Space::kDim, 1> vector;
    for (int i = 0; i < Space::kDim; ++i) vector[i] = (*this)[i];
    return vector;
  }

  static SpatialVector Zero() { return {Angular<Space, S>::Zero(), Linear<Space, S>::Zero()}; }
  static SpatialVector Unit(int i) {
    SpatialVector unit = Zero();
    unit[i] = S(1);
    return unit;
  }
  LOOPBENCH_INLINE void setZero() {
    angular.setZero();
    linear.setZero();
  }
  S& operator[](int i) { return i < Space::kRot ? angular[i] : linear[i - Space::kRot]; }
  const S& operator[](int i) const {
    return i < Space::kRot ? angular[i] : linear[i - Space::kRot];
  }

  /// Power of a force, or a component along a direction.
  template <class Other>
  requires HaveProduct<Kind, Other> LOOPBENCH_INLINE S
  dot(const SpatialVector<Space, S, Other>& other)
  const { return angular.dot(other.angular) + linear.dot(other.linear); }
  /// Squared norm over all components regardless of units: for sizes and tolerances.
  S squaredNorm() const { return angular.squaredNorm() + linear.squaredNorm(); }
  S norm() const {
    using std::sqrt;
    return sqrt(squaredNorm());
  }

  LOOPBENCH_INLINE SpatialVector& operator+=(const SpatialVector& other) {
    angular += other.angular;
    linear += other.linear;
    return *this;
  }
  LOOPBENCH_INLINE SpatialVector& operator-=(const SpatialVector& other) {
    angular -= other.angular;
    linear -= other.linear;
    return *this;
  }
  LOOPBENCH_INLINE SpatialVector& operator*=(const S& factor) {
    angular *= factor;
    linear *= factor;
    return *this;
  }
  LOOPBENCH_INLINE SpatialVector& operator/=(const S& divisor) {
    angular /= divisor;
    linear /= divisor;
    return *this;
  }
  LOOPBENCH_INLINE friend SpatialVector operator+(SpatialVector a, const SpatialVector& b) {
    return a += b;
  }
  LOOPBENCH_INLINE friend SpatialVector operator-(SpatialVector a, const SpatialVector& b) {
    return a -= b;
  }
  LOOPBENCH_INLINE friend SpatialVector operator-(const SpatialVector& a) {
    return {-a.angular, -a.linear};
  }
  LOOPBENCH_INLINE friend SpatialVector operator*(SpatialVector a, const S& factor) {
    return a *= factor;
  }
  LOOPBENCH_INLINE friend SpatialVector operator*(const S& factor, SpatialVector a) {
    return a *= factor;
  }
  LOOPBENCH_INLINE friend SpatialVector operator/(SpatialVector a, const S& divisor) {
    return a /= divisor;
  }
};

/// [w; v] of a body at a point.
template <class Space, class S>
using Velocity = SpatialVector<Space, S, VelocityKind>;
/// [alpha; a] of a body at a point.
template <class Space, class S>
using Acceleration = SpatialVector<Space, S, AccelerationKind>;
/// [moment; force] on a body at a point.
template <class Space, class S>
using Wrench = SpatialVector<Space, S, ForceKind>;
/// Column of H or D of a joint, at its point.
template <class Space, class S>
using Direction = SpatialVector<Space, S, DirectionKind>;
/// A number per direction of a joint, in the order of its D; those beyond the joint's own are zero.
template <class Space, class S>
using Components = Small<S, Space::kDim>;
/// Inertia, which maps motions to wrenches, or its inverse.
template <class Space, class S>
using Block = Small<S, Space::kDim, Space::kDim>;
/// Orientation matrix.
template <class Space, class S>
using Rotation = Small<S, Space::kLin, Space::kLin>;

/// w x r.
template <class S>
LOOPBENCH_INLINE Small<S, 2> Cross(const Small<S, 1>& w, const Small<S, 2>& r) {
  return {-w[0] * r[1], w[0] * r[0]};
}
template <class S>
LOOPBENCH_INLINE Small<S, 3> Cross(const Small<S, 3>& w, const Small<S, 3>& r) {
  return w.cross(r);
}

/// r x f, a moment.
template <class S>
LOOPBENCH_INLINE Small<S, 1> Moment(const Small<S, 2>& r, const Small<S, 2>& f) {
  return Small<S, 1>(r[0] * f[1] - r[1] * f[0]);
}
template <class S>
LOOPBENCH_INLINE Small<S, 3> Moment(const Small<S, 3>& r, const Small<S, 3>& f) {
  return r.cross(f);
}

/// a x b of two angular vectors: zero in the plane.
template <class S>
LOOPBENCH_INLINE Small<S, 1> CrossAngular(const Small<S, 1>&, const Small<S, 1>&) {
  return Small<S, 1>::Zero();
}
template <class S>
LOOPBENCH_INLINE Small<S, 3> CrossAngular(const Small<S, 3>& a, const Small<S, 3>& b) {
  return a.cross(b);
}

/// Returns the velocity of a body at c + r from its velocity at c: [w; v + w x r]. Also for
/// accelerations, without the centripetal part, and directions of motion.
template <class Space, class S, KindOfMotion Kind>
LOOPBENCH_INLINE SpatialVector<Space, S, Kind> ShiftMotion(const SpatialVector<Space, S, Kind>& V,
                                                           const Linear<Space, S>& r) {
  return {V.angular, V.linear + Cross<S>(V.angular, r)};
}

/// Returns the same force at c instead of c + r: [moment + r x f; f]. The transpose of
/// ShiftMotion(). Also for directions of forces.
template <class Space, class S, KindOfForce Kind>
LOOPBENCH_INLINE SpatialVector<Space, S, Kind> ShiftForce(const SpatialVector<Space, S, Kind>& F,
                                                          const Linear<Space, S>& r) {
  return {F.angular + Moment<S>(r, F.linear), F.linear};
}

/// Both parts in other axes; the plane turns about its normal, which leaves angular parts alone.
template <class Space, class S, class Kind>
LOOPBENCH_INLINE SpatialVector<Space, S, Kind> Rotate(const Rotation<Space, S>& R,
                                                      const SpatialVector<Space, S, Kind>& V) {
  if constexpr (Space::kRot == 1) {
    return {V.angular, R * V.linear};
  } else {
    return {R * V.angular, R * V.linear};
  }
}

/// Returns the product of a block and a pair, as the kind given by the caller: an inertia maps
/// velocities to momenta and accelerations to forces, its inverse maps back.
template <class Result, class Space, class S, class Kind>
LOOPBENCH_INLINE Result Apply(const Block<Space, S>& A, const SpatialVector<Space, S, Kind>& x) {
  Result product;
  LOOPBENCH_UNROLL
  for (int i = 0; i < Space::kDim; ++i) product[i] = A(i, 0) * x[0];
  LOOPBENCH_UNROLL
  for (int k = 1; k < Space::kDim; ++k) {
    LOOPBENCH_UNROLL
    for (int i = 0; i < Space::kDim; ++i) product[i] += A(i, k) * x[k];
  }
  return product;
}

/// A -= x y^T.
template <class Space, class S, class Kind>
LOOPBENCH_INLINE void SubtractOuter(const SpatialVector<Space, S, Kind>& x,
                                    const SpatialVector<Space, S, Kind>& y, Block<Space, S>& A) {
  LOOPBENCH_UNROLL
  for (int j = 0; j < Space::kDim; ++j) {
    LOOPBENCH_UNROLL
    for (int i = 0; i < Space::kDim; ++i) A(i, j) -= x[i] * y[j];
  }
}

/// [rotational 0; 0 linear times one].
template <class Space, class S>
LOOPBENCH_INLINE Block<Space, S> DiagonalBlock(const Small<S, Space::kRot, Space::kRot>& rotational,
                                               const S& linear) {
  Block<Space, S> block = Block<Space, S>::Zero();
  for (int j = 0; j < Space::kRot; ++j) {
    for (int i = 0; i < Space::kRot; ++i) block(i, j) = rotational(i, j);
  }
  for (int i = Space::kRot; i < Space::kDim; ++i) block(i, i) = linear;
  return block;
}

}  // namespace loopbench
