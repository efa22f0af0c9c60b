// Poses, motions and joint frames of a mechanism at one (q, u): the workspace all formulations
// share.
//
// Everything is in ground axes. Motions and wrenches of a body are taken at its centre of mass; for
// a joint at Mo, the origin of the frame M fixed on its body Q (see joint.h). The paper computes
// positions and velocities by its first two sweeps (assembly and disassembly). Here they are a walk
// along the spanning tree from Ground outwards, body after body.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "mechanism/model/mechanism.h"

namespace loopbench {

/// Eigenvalues of loops below this share of the largest are regularized (direction_weights.h).
inline constexpr double kRegularization = 4e-8;

/// A joint at the current position and speed.
template <class Space, class S>
struct JointState {
  Linear<Space, S> r_P, r_Q;  ///< Mo from the centres of mass of P and Q
  Velocity<Space, S> V_rel;   ///< [w_Q - w_P; v_Q - v_P], both points at Mo
  Acceleration<Space, S> g;   ///< A_Q - A_P = H udot + g, both points at Mo             (7)
  Basis<Space, S> basis;      ///< [H D], columns orthogonal
  int num_u = 0, num_rows = 0;

  /// Column i of the motion map.
  const Direction<Space, S>& H(int i) const { return basis[i]; }
  /// Returns constrained direction i: prescribed coordinates first, then other imposed ones,
  /// `rows()` in all. Directions released as redundant (redundancy.h) follow, `directions()` in
  /// all.
  const Direction<Space, S>& D(int i) const { return basis[num_u + i]; }
  int rows() const { return num_rows; }
  int directions() const { return Space::kDim - num_u; }

  /// The first `count` components D^T V of a velocity, an acceleration or a mismatch; others zero.
  template <class Kind>
  Components<Space, S> Along(const SpatialVector<Space, S, Kind>& V, int count) const {
    Components<Space, S> components = Components<Space, S>::Zero();
    for (int i = 0; i < count; ++i) components[i] = D(i).dot(V);
    return components;
  }
  /// The sum of the first `count` directions times these numbers.
  Direction<Space, S> Sum(const Components<Space, S>& numbers, int count) const {
    Direction<Space, S> sum = Direction<Space, S>::Zero();
    for (int i = 0; i < count; ++i) sum += D(i) * numbers[i];
    return sum;
  }
};

/// Parts of a direction that need not be zero, and whether it moves in axes that turn with P.
struct DirectionParts {
  bool turns = true, shifts = true, moves = true;
};

/// The wrench at Mo of an effort along a coordinate with the direction H: its power is tau u. An
/// effort on a screw is a moment. The force along the axis belongs to the constraint of its thread.
template <class Space, class S>
Wrench<Space, S> WrenchOfEffort(const Direction<Space, S>& H, const S& inverse_H_squared,
                                const S& tau) {
  const bool is_unit = inverse_H_squared == S(1);
  if (is_unit || H.angular.isZero() || H.linear.isZero()) return H * (tau * inverse_H_squared);
  return {H.angular * (tau / H.angular.squaredNorm()), Linear<Space, S>::Zero()};
}

template <class Space, class S>
class Kinematics {
 public:
  explicit Kinematics(const Mechanism<Space, S>& mechanism);

  /// The time [s] that prescribed motions and time-dependent forces are taken at; 0 until set. To
  /// be called before the positions are updated.
  void SetTime(S t);
  S time() const { return time_; }
  /// Values of the mechanism's drives at that time.
  const std::vector<TimeValue<S>>& drives() const { return drives_; }
  /// Other rates and accelerations of the drives, until the next SetTime(). UpdateVelocity() takes
  /// them.
  void SetDrives(const std::vector<TimeValue<S>>& drives) { drives_ = drives; }

  /// Poses, joint points and directions from q.
  void UpdatePosition(const Eigen::Ref<const VectorX<S>>& q);
  /// Motions and g from u; positions must be current.
  void UpdateVelocity(const Eigen::Ref<const VectorX<S>>& u);

  /// Sets this share for the present positions; it remains until the next call.
  void SetRegularization(double share) { regularization_ = share; }
  double regularization() const { return regularization_; }

  const VectorX<S>& q() const { return q_; }  ///< of the last UpdatePosition()
  const VectorX<S>& u() const { return u_; }  ///< of the last UpdateVelocity()

  /// Returns the number of UpdatePosition() calls; results from positions are valid while equal.
  long position_version() const { return position_version_; }

  const Mechanism<Space, S>& mechanism() const { return *mechanism_; }
  const std::vector<Pose<Space, S>>& poses() const { return poses_; }          ///< at the com
  const std::vector<Velocity<Space, S>>& motions() const { return motions_; }  ///< at the com
  const std::vector<JointState<Space, S>>& joints() const { return joints_; }
  /// [H D] of a joint, to be changed until the next UpdatePosition().
  Basis<Space, S>& basis(int joint) { return joints_[joint].basis; }

  /// Returns the classical acceleration of the point of `body` at r from its centre of mass minus
  /// the acceleration of the centre of mass, for zero angular acceleration: [0; w x (w x r)].
  Acceleration<Space, S> Centripetal(int body, const Linear<Space, S>& r) const;

  /// Rotational inertia of a body in ground axes, and its inverse.
  typename Inertia<Space, S>::Matrix RotationalInertia(const Inertia<Space, S>& inertia,
                                                       int body) const;
  typename Inertia<Space, S>::Matrix RotationalInverse(const Inertia<Space, S>& inertia,
                                                       int body) const;

  /// Mo of a joint from the centres of P and Q that the masses are at.
  Linear<Space, S> ArmP(int joint, Masses masses) const {
    return Arm(mechanism_->joints()[joint].from, joints_[joint].r_P, masses);
  }
  Linear<Space, S> ArmQ(int joint, Masses masses) const {
    return Arm(mechanism_->joints()[joint].to, joints_[joint].r_Q, masses);
  }

  /// Mo of a joint from the ground origin.
  Linear<Space, S> JointPoint(int joint) const {
    return poses_[mechanism_->joints()[joint].from].p + joints_[joint].r_P;
  }

  /// Returns the violation of a constraint in ground axes: [rotation; shift], see joint.h. D^T
  /// times it is the constraint function whose Jacobian is tree_dynamics.h's J.
  Velocity<Space, S> ConstraintMismatch(int joint) const;

  /// The part of a relative motion that a constraint forbids, with directions released because
  /// others forbid them, but without those released for the accuracy of the input only.
  template <class Kind>
  Direction<Space, S> Constrained(int joint, const SpatialVector<Space, S, Kind>& V) const {
    const JointState<Space, S>& state = joints_[joint];
    if (mechanism_->is_redundant()) return Forbidden(joint, V);
    Direction<Space, S> part = state.Sum(state.Along(V, state.rows()), state.rows());
    for (const MovingRow& row : moving_rows_) {
      if (row.joint == joint) part += direction(row) * direction(row).dot(V);
    }
    return part;
  }
  /// The part of a relative motion across the free directions of a joint.
  template <class Kind>
  Direction<Space, S> Forbidden(int joint, const SpatialVector<Space, S, Kind>& V) const {
    const JointState<Space, S>& state = joints_[joint];
    Direction<Space, S> part(V.angular, V.linear);
    for (int i = 0; i < state.num_u; ++i) {
      part -= state.H(i) * (state.H(i).dot(V) / state.H(i).squaredNorm());
    }
    return part;
  }

  /// D^T V_rel less the rates of prescribed coordinates: zero when a constraint holds at velocity
  /// level. joints()[joint].rows() numbers, the others zero.
  Components<Space, S> ConstraintSpeed(int joint) const;

  /// X_FM of a joint of the mechanism from the poses of its bodies.
  Pose<Space, S> MeasuredPose(const Joint<Space, S>& joint) const;

  /// Measured coordinate and speed of a joint with one coordinate (q, u for tree joints).
  S JointCoordinate(int joint) const;
  S JointSpeed(int joint) const;

  /// sum_i ratio_i q_i less the offset, and its rate. Angles of cut joints are counted so that
  /// couplings hold at the start.
  S CouplingMismatch(int coupling) const;
  S CouplingSpeed(int coupling) const;
  /// A mismatch or a rate of a coupling in the unit of its first coordinate [rad or m].
  S OfFirstJoint(int coupling, const S& mismatch) const {
    const Coupling<S>& given = mechanism_->couplings()[coupling];
    return given.is_moving_row ? mismatch : S(mismatch / given.parts.front().ratio);
  }
  /// Returns true if that unit is an angle.
  bool FirstTurns(int coupling) const {
    const MovingRow first = FirstOf(coupling);
    return !joints_[first.joint].basis[first.column].angular.isZero();
  }
  /// Its first joint and direction.
  MovingRow FirstOf(int coupling) const {
    const Coupling<S>& given = mechanism_->couplings()[coupling];
    return given.is_moving_row ? moving_row(coupling) : MovingRow{given.parts.front().joint, 0};
  }

  /// The released direction imposed by a coupling that is a moving row.
  const MovingRow& moving_row(int coupling) const {
    return moving_rows_[coupling - mechanism_->num_coordinate_couplings()];
  }
  const std::vector<MovingRow>& moving_rows() const { return moving_rows_; }
  const Direction<Space, S>& direction(const MovingRow& row) const {
    return joints_[row.joint].basis[row.column];
  }

  /// Directions that are not imposed from now on, as many of each joint as the mechanism releases.
  /// Part of the mode; the positions must be updated afterwards.
  void Release(const std::vector<Released>& released);
  const std::vector<Released>& released() const { return released_; }
  /// Returns the direction of its kind's D that a row of a constraint imposes (not of a prescribed
  /// coordinate).
  int DirectionOf(int joint, int row) const;

  /// Parts of the columns of a joint's [H D], in their order of the last Release().
  std::array<DirectionParts, Space::kDim> PartsOf(int joint) const;
  /// Rates of those of the first `count` columns that move in axes that turn with P, in these axes
  /// and as components along ground axes; others are not set. Motions must be current. Without
  /// JointKind::basis_rate they are central differences, with relative errors of 1e-10.
  void OwnRates(int joint, const std::array<DirectionParts, Space::kDim>& parts, int count,
                Basis<Space, S>& rates) const;

  /// Remembers the coordinates of cut joints, so that the next angles are unwrapped from here.
  /// Called at accepted steps only (the one memory of this class, part of the mode).
  void AcceptStep();
  /// Continues the measured coordinate of a joint from this value, after SetTime().
  void ContinueFrom(int joint, const S& coordinate) {
    turns_are_counted_ = false;
    accepted_[joint] = coordinate;
    accepted_speeds_[joint] = S(0);
  }
  /// Continues measured angles from the initial values of the mechanism, as at first.
  void ForgetSteps();
  /// Sets the turns of measured angles so that couplings hold. Call after AcceptStep() at a start.
  void CountTurns();
  /// Continues angles from where `other` does.
  template <class T>
  void CountTurnsLike(const Kinematics<Space, T>& other) {
    accepted_.assign(other.accepted_.begin(), other.accepted_.end());
    accepted_speeds_.assign(other.accepted_speeds_.begin(), other.accepted_speeds_.end());
    turns_.assign(other.turns_.begin(), other.turns_.end());
    whole_turns_.assign(other.whole_turns_.begin(), other.whole_turns_.end());
    accepted_time_ = S(other.accepted_time_);
    turns_are_counted_ = other.turns_are_counted_;
  }
  /// Whole turns [rad] that planar angles of cut joints have beyond the angles of their bodies, by
  /// joint. Part of the mode: counted at the first AcceptStep(), from the initial values.
  const std::vector<S>& whole_turns() const { return whole_turns_; }
  void TakeWholeTurns(std::span<const double> turns) {
    whole_turns_.assign(turns.begin(), turns.end());
    turns_are_counted_ = true;
  }

  /// q of a mechanism with the same bodies, from body poses here (other coordinate set).
  VectorX<S> CoordinatesIn(const Mechanism<Space, S>& other) const;
  /// Returns u for the same.
  VectorX<S> SpeedsIn(const Kinematics& other) const;

 private:
  template <class, class>
  friend class Kinematics;
  /// The coordinate of a cut joint with one, angles up to whole turns.
  S Measured(int index) const;
  /// Whole turns that bring a measured angle next to the last accepted one.
  S WholeTurns(int index, const S& measured) const;
  Linear<Space, S> Arm(int body, const Linear<Space, S>& r, Masses masses) const {
    if (masses == Masses::kPhysical) return r;
    return r - poses_[body].R * mechanism_->geometric_centre(body);
  }
  void AddBias(int index, const Joint<Space, S>& joint, JointState<Space, S>& state) const;
  /// Coordinates of a tree joint, prescribed ones among them, in `room`.
  const S* JointCoordinates(const Joint<Space, S>& joint, S* room) const;
  void PlaceChild(const TreeStep& step);
  void MeasureCut(int index);
  void FollowDirections(int index, const Rotation<Space, S>& R_WF);
  void SetDirections(int index, const Rotation<Space, S>& R_WF);
  /// Puts columns of a kind's [H D], or data for them, into the order of rows.
  template <class Columns>
  void OrderDirections(int index, Columns& columns) const;

  const Mechanism<Space, S>* mechanism_;
  std::vector<Pose<Space, S>> poses_;
  std::vector<Velocity<Space, S>> motions_;
  std::vector<JointState<Space, S>> joints_;
  /// X_FM: of tree joints from q, of constraints from the body poses. In the plane the matrix is
  /// the rotation of the angle only for kinds with a basis.
  std::vector<Pose<Space, S>> joint_poses_;
  std::vector<TimeValue<S>> drives_;
  std::vector<S> accepted_;  ///< last accepted coordinate of each joint
  /// In space: speeds of cut joints and the time at the last accepted step; they predict angles. By
  /// coupling: the turns that measured angles lack.
  std::vector<S> accepted_speeds_, turns_;
  S accepted_time_ = S(0);
  std::vector<S> whole_turns_;
  bool turns_are_counted_ = false;
  std::vector<Released> released_;
  std::vector<MovingRow> moving_rows_;
  VectorX<S> q_, u_;
  S time_ = S(0);
  double regularization_ = kRegularization;
  long position_version_ = 0;
};

/// Wrench of applied forces at each body's centre of mass: gravity, forces at points and between
/// points, joint forces (H tau on Q, the opposite on P), at time(). `wrenches` has one entry per
/// body.
template <class Space, class S>
void AppliedForces(const Kinematics<Space, S>& kinematics, std::span<Wrench<Space, S>> wrenches);
/// Does the same without gravity.
template <class Space, class S>
void ForcesBesideGravity(const Kinematics<Space, S>& kinematics,
                         std::span<Wrench<Space, S>> wrenches);

/// Returns energies [J] at the current position and speed; potential is zero for centres of mass in
/// the ground origin and springs at rest. Constant forces on points (ground axes) and joints, and
/// preloads, count as potentials. Forces in AppliedPower() do not.
template <class S>
struct Energy {
  S kinetic = S(0);
  S potential = S(0);
  S total() const { return kinetic + potential; }
};
template <class Space, class S>
Energy<S> ComputeEnergy(const Kinematics<Space, S>& kinematics);

/// Returns the power that forces without a potential supply and dissipate (force_elements.h).
template <class Space, class S>
Power<S> AppliedPower(const Kinematics<Space, S>& kinematics);

}  // namespace loopbench
