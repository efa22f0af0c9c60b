// The motion of the user's bodies and joints, and the reactions in them.
#pragma once

#include <Eigen/Geometry>
#include <memory>
#include <span>
#include <vector>

#include "mechanism/model/kinematics.h"
#include "mechanism/simplify/compile.h"

namespace loopbench::harness {

// Where a user's body is and how it moves, whatever the mechanism was compiled to.

/// In the user's ground axes, at the body's origin; accelerations are those of its points.
struct BodyMotion {
  Frame pose;
  double angle = 0.0;                                  ///< of planar scenes, with whole turns [rad]
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();  ///< [m/s]
  Eigen::Vector3d angular_velocity = Eigen::Vector3d::Zero();      ///< [rad/s]
  Eigen::Vector3d acceleration = Eigen::Vector3d::Zero();          ///< [m/s^2]
  Eigen::Vector3d angular_acceleration = Eigen::Vector3d::Zero();  ///< [rad/s^2]

  /// A point given in body axes, its velocity and its acceleration, in ground axes.
  Eigen::Vector3d PointAt(const Eigen::Vector3d& at) const { return pose.p + pose.R * at; }
  Eigen::Vector3d VelocityAt(const Eigen::Vector3d& at) const {
    return velocity + angular_velocity.cross(pose.R * at);
  }
  Eigen::Vector3d AccelerationAt(const Eigen::Vector3d& at) const {
    const Eigen::Vector3d r = pose.R * at;
    return acceleration + angular_acceleration.cross(r) +
           angular_velocity.cross(angular_velocity.cross(r));
  }
};

/// All bodies at rest at the origin, but those that were made part of Ground, where they are.
std::vector<BodyMotion> AtRest(const Compiled& compiled);

/// Enters all bodies of one part. `accelerations` are those of its centres of mass by the part's
/// body; empty where they are not known, which leaves NaN.
template <class Space>
void EnterPart(const Compiled& compiled, int part, const Kinematics<Space, double>& kinematics,
               std::span<const Acceleration<Space, double>> accelerations,
               std::vector<BodyMotion>* bodies);

// The user's own mechanism, nothing compiled away, put where its bodies are.
//
// What a trajectory says of joints, forces and energies is measured here, from the motion of bodies
// alone: the same functions serve a run of ours, whatever it was compiled to and integrated in, and
// the motion that another program says its bodies have.

/// Largest mismatch of one joint: in the directions that it constrains.
struct JointMismatch {
  double shift = 0.0;             ///< [m]
  double rotation = 0.0;          ///< [rad]
  double velocity = 0.0;          ///< [m/s]
  double angular_velocity = 0.0;  ///< [rad/s]
};

template <class Space>
class UserMechanism {
 public:
  explicit UserMechanism(const MechanismDescription& user);

  /// `bodies` by the user's body, Ground included.
  void Set(double t, std::span<const BodyMotion> bodies);

  const Mechanism<Space, double>& mechanism() const { return mechanism_; }
  const Kinematics<Space, double>& kinematics() const { return kinematics_; }

  /// Coordinates (an angle in space as the principal one) and speeds of a joint, prescribed ones
  /// among them, as many as its kind has; at most seven and six.
  void Measure(int joint, double* q, double* u) const;
  /// Direction of the i-th speed of a joint's kind, prescribed or not, at the joint's point.
  const Direction<Space, double>& DirectionOfSpeed(int joint, int i) const;

  /// Of a joint of the user's.
  JointMismatch MismatchOf(int joint) const;
  /// Largest mismatch of all joints: the rotation [rad], or the shift over the mechanism's length.
  double RelativeMismatch() const;

 private:
  Mechanism<Space, double> mechanism_;  ///< in absolute coordinates, nothing released
  Kinematics<Space, double> kinematics_;
  std::vector<Eigen::Vector3d> com_;
  VectorX<double> q_, u_;
};

// What joints bear: the forces and moments that hold the user's bodies together.
//
// With the accelerations of all bodies known, each body needs the wrench w = M A + c - f_applied,
// and its joints must give it. With D lambda the wrench of a joint on its second body, at its point
// Mo, and its opposite on the first,
//
//   sum over joints of S(r) D lambda = w        body by body                                (*)
//
// That asks for no formulation's multipliers: those of O-DCA, of the Lagrange equations and of
// reduction solve the same equations in fewer unknowns, and agree as far as their accelerations do.
// It holds for every joint of the user's, those between bodies that the compile step has merged,
// and out of the plane that a run was simplified to.
//
// Bodies with one joint left are solved one after the other from the leaves inwards; what stays are
// loops, part by part: sparse QR where there are many unknowns, dense with pivoting where there are
// few or where the sparse one finds them dependent. Redundant constraints share a load as their
// stiffness says, which rigid bodies do not have. So a component of a reaction is known where no
// solution of (*) with w = 0 changes it, and NaN where one does. Positions that miss each other by
// a share e of a length leave directions open that (*) holds by less than 10 e.

template <class Space>
class Reactions {
 public:
  /// `user` must outlive it.
  explicit Reactions(const UserMechanism<Space>& user);
  ~Reactions();

  /// At the present state of the mechanism. `A` are accelerations of the centres of mass by body,
  /// `applied` all other forces there.
  void Solve(std::span<const Acceleration<Space, double>> A,
             std::span<const Wrench<Space, double>> applied);

  /// Components of the wrench on the joint's second body at the joint's point: [moment; force]
  /// along the columns of `axes`, in ground axes. Without what drives give; NaN where not unique.
  Wrench<Space, double> Of(int joint, const Rotation<Space, double>& axes) const;

  /// What a prescribed motion takes along its coordinate, so that its power is this times the speed
  /// [N m or N]; NaN where not unique.
  double DriveOf(int joint, int coordinate) const;

 private:
  struct Work;
  std::unique_ptr<Work> work_;
};

}  // namespace loopbench::harness
