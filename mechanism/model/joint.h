// A joint kind defines the motion of frame M of body Q in frame F of body P.
//
// With q the coordinates and u the speeds of the joint (paper, table 1 and eq. 7-9):
//
//   X_FM(q)         pose of M in F
//   H_F(q)          motion map, [w_FM; v_FMo] = H_F u in F axes; its columns are orthogonal,
//                   and of unit length in every kind but the helical one
//   D_F(q)          its orthogonal complement, D_F^T H_F = 0: the directions of constraint forces
//   qdot = N(q) u   kinematic rates
//   q*(X_FM)        coordinates of the admissible pose nearest to a measured one; the remainder
//                   is the joint's constraint violation (position drift)
//
// The constraint of a joint is imposed at one point, that of P and that of Q which now coincide
// with Mo. In ground axes, with w_rel and v_rel the measured relative motion seen from F,
//
//   A_Q - A_P = H udot + g,        g = Hdot u + [w_P x w_rel; 2 w_P x v_rel]              (7)
//
// where Hdot u is the derivative in F, zero for most kinds, whose H_F is constant. With this g, D^T
// (A_Q - A_P - g) = 0 means that the violation, in F axes, has zero second derivative (to first
// order in a rotation violation in space).
//
// Coordinates, in F axes:
//   revolute        angle about z
//   prismatic       shift along x
//   weld            none
//   free            plane: angle, x, y; space: quaternion w x y z, then x, y, z
//   pin-in-slot     angle about z, shift along x
//   rod             none; the distance of Mo from Fo is constant, and D is along it
//   cylindrical     angle about z, shift along z
//   spherical       quaternion w x y z
//   planar          angle about z, x, y
//   universal       angle about x, then about the turned y
//   helical         angle about z, along which it shifts by `pitch` times the angle
//   translation     x, y, z
//   schoenflies     angle about z, x, y, z
//   point-on-line   quaternion w x y z, shift along x
//   point-in-plane  quaternion w x y z, x, y
// Speeds are their rates; with a quaternion, the angular velocity. A quaternion is normalised on
// use, so its length carries no information.
#pragma once

#include <array>

#include "mechanism/algebra/space.h"
#include "mechanism/description/description.h"

namespace loopbench {

/// Columns of [H D].
template <class Space, class S>
using Basis = std::array<Direction<Space, S>, Space::kDim>;

template <class Space, class S>
struct JointKind {
  int num_q = 0;
  int num_u = 0;
  /// If every direction of H and D is a constant coordinate axis of F: [H D] as a permutation of
  /// the components of a motion. The num_u free ones come first.
  std::array<int, Space::kDim> axes{};
  /// True if no rotation of F changes the spaces of D and H, as for a planar revolute joint. Both
  /// may then be taken in ground axes.
  bool rotation_invariant = false;

  /// Parameter of the kinds helical (pitch [m/rad]) and rod (length [m]); 0 for others.
  S parameter = S(0);
  /// True if some direction both turns and shifts. Otherwise column i of [H D] turns if axes[i] <
  /// kRot, and shifts if not. Found from `basis` and `exact_basis`.
  bool has_screws = false;
  /// 1 / |H|^2 of each column of H, by which u = inverse_H_squared H^T V for a relative velocity V.
  /// It is 1 in every built-in kind but the helical, whose H is [z; pitch z]; found from `basis`.
  S inverse_H_squared = S(1);

  /// X_FM; in the plane the angle and the shift suffice (PoseAt() has the matrix, too).
  void (*transform)(const S* q, Pose<Space, S>& X_FM, S parameter) = nullptr;
  void (*coordinates)(const Pose<Space, S>& X_FM, S* q, S parameter) = nullptr;
  void (*rates)(const S* q, const S* u, S* qdot) = nullptr;

  /// If directions are not axes: [H D] in F axes at a pose, orthogonal; null otherwise.
  void (*basis)(const Pose<Space, S>& X_FM, Basis<Space, S>& basis_F, S parameter) = nullptr;
  /// Hdot u in F axes, for a relative velocity V in F axes; null if zero.
  Acceleration<Space, S> (*bias)(const Pose<Space, S>& X_FM, const Velocity<Space, S>& V) = nullptr;

  /// `basis` and `bias` of a constraint whose violation may exceed round-off: components of D^T V
  /// and their rates are then the first and second derivatives of the violation to first order in
  /// it. Null if those above are, as for constraints on shifts or on all rotations.
  void (*exact_basis)(const Pose<Space, S>& X_FM, Basis<Space, S>& basis_F, S parameter) = nullptr;
  Acceleration<Space, S> (*exact_bias)(const Pose<Space, S>& X_FM,
                                       const Velocity<Space, S>& V) = nullptr;

  /// The rate of `basis` [H D] for a relative velocity V, both in F axes, if only angular parts
  /// move; null otherwise or if unknown.
  void (*basis_rate)(const Pose<Space, S>& X_FM, const Velocity<Space, S>& V,
                     Basis<Space, S>& rate_F) = nullptr;
  void (*exact_basis_rate)(const Pose<Space, S>& X_FM, const Velocity<Space, S>& V,
                           Basis<Space, S>& rate_F) = nullptr;

  bool has_quaternion() const { return num_q > num_u; }
  int num_constraints() const { return Space::kDim - num_u; }
  /// Returns true for an angle that is measured modulo a turn; the shift of a helix determines its.
  bool IsAngle(int coordinate) const {
    return !has_quaternion() && parameter == S(0) && axes[coordinate] < Space::kRot;
  }
};

/// The kind's data and functions, with parameter zero. Lives forever.
template <class Space, class S>
const JointKind<Space, S>& KindOf(JointType type);

/// Does the same for one joint, with its own parameter.
template <class Space, class S>
JointKind<Space, S> KindWith(JointType type, S parameter);

/// Adds a kind's functions under the number that its traits have got.
template <class Space, class S>
void AddKind(JointType type, const JointKind<Space, S>& kind);

/// X_FM at q, all of it.
template <class Space, class S>
Pose<Space, S> PoseAt(const JointKind<Space, S>& kind, const S* q) {
  Pose<Space, S> X_FM;
  kind.transform(q, X_FM, kind.parameter);
  if constexpr (Space::kRot == 1) X_FM.SetAngle(X_FM.angle);
  return X_FM;
}

/// Returns the deviation of M from its nearest admissible pose, in F axes: [rotation vector;
/// shift], signed like a velocity. Its components along D are the constraint violation [rad, m].
template <class Space, class S>
Velocity<Space, S> Mismatch(const JointKind<Space, S>& kind, const Pose<Space, S>& X_FM);

}  // namespace loopbench
