// The motion of the user's bodies and joints, and the reactions in them.
#pragma once

#include <Eigen/Geometry>
#include <memory>
#include <span>
#include <vector>

#include "mechanism/model/kinematics.h"
#include "mechanism/simplify/compile.h"

namespace loopbench::harness {

// Poses and motions of the user's bodies, however the mechanism was compiled.

/// Motion in the user's ground axes, at the body's origin; accelerations are of material points.
struct BodyMotion {
  Frame pose;
  double angle = 0.0;                                  ///< of planar problems, with full turns
                                                       ///< [rad]
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();  ///< [m/s]
  Eigen::Vector3d angular_velocity = Eigen::Vector3d::Zero();      ///< [rad/s]
  Eigen::Vector3d acceleration = Eigen::Vector3d::Zero();          ///< [m/s^2]
  Eigen::Vector3d angular_acceleration = Eigen::Vector3d::Zero();  ///< [rad/s^2]

  /// Returns the position, velocity or acceleration, in ground axes, of a point in body axes.
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

/// Returns all bodies at rest at the origin; bodies merged with Ground have their fixed pose.
std::vector<BodyMotion> AtRest(const Compiled& compiled);

/// Sets all bodies of one part. `accelerations` are given at the centres of mass, by the part's
/// body. If empty, accelerations become NaN.
template <class Space>
void EnterPart(const Compiled& compiled, int part, const Kinematics<Space, double>& kinematics,
               std::span<const Acceleration<Space, double>> accelerations,
               std::vector<BodyMotion>* bodies);

// The user's original mechanism, with nothing compiled away, at given body motions.
//
// Joint values, forces and energies of a trajectory are computed here from body motions alone. The
// same functions serve Loopbench runs, however they were compiled and integrated, and body motions
// from other programs.

/// Largest constraint violation of one joint.
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

  /// Sets the state from `bodies`, indexed by the user's body, Ground included. Angles of joints
  /// in space include full turns. They continue from `followed` (by joint, NaN if unknown),
  /// otherwise from the last call, at first from the initial values.
  void Set(double t, std::span<const BodyMotion> bodies, std::span<const double> followed = {});

  const Mechanism<Space, double>& mechanism() const { return mechanism_; }
  const Kinematics<Space, double>& kinematics() const { return kinematics_; }

  /// Computes coordinates (a spatial angle as the principal value) and speeds of a joint, including
  /// prescribed ones; at most seven and six.
  void Measure(int joint, double* q, double* u) const;
  /// Returns the direction of the i-th speed of a joint, prescribed or not, at the joint's point.
  const Direction<Space, double>& DirectionOfSpeed(int joint, int i) const;

  /// Returns the constraint violation of a joint of the user.
  JointMismatch MismatchOf(int joint) const;
  /// Returns the largest of all rotations [rad] and of all shifts over the mechanism's length.
  double RelativeMismatch() const;

 private:
  Mechanism<Space, double> mechanism_;  ///< in absolute coordinates, nothing released
  Kinematics<Space, double> kinematics_;
  std::vector<Eigen::Vector3d> com_;
  VectorX<double> q_, u_;
};

// Joint reactions: forces and moments that hold the user's bodies together.
//
// Each body needs the wrench w = M A + c - f_applied, which follows from all body accelerations.
// The joints must supply it. The wrench of a joint is D lambda on its second body, at its point Mo,
// and the opposite on the first:
//
//   sum over joints of S(r) D lambda = w        body by body                                (*)
//
// This needs no multipliers of a formulation. O-DCA, the Lagrange equations and reduction solve the
// same equations in fewer unknowns, and agree to the accuracy of their accelerations. It holds for
// all joints of the user: also between merged bodies, and out of the plane of a problem simplified
// to planar.
//
// Couplings add a column each, their efforts over the coefficients; they are not part of a joint's
// reaction. All joints are then one part. Bodies with one joint left are solved in turn from the
// leaves inwards. The remaining loops are solved part by part: by sparse QR for many unknowns, by
// dense QR with pivoting for few or dependent ones. Rigid bodies do not determine how redundant
// constraints share a load. A reaction component is known if no solution of (*) with w = 0 changes
// it, else NaN. Positions with a relative violation e leave directions free in which (*) holds to
// less than 10 e.

template <class Space>
class Reactions {
 public:
  /// `user` must outlive it.
  explicit Reactions(const UserMechanism<Space>& user);
  ~Reactions();

  /// Solves at the present state of the mechanism. `A`: accelerations of the centres of mass by
  /// body; `applied`: all other forces there.
  void Solve(std::span<const Acceleration<Space, double>> A,
             std::span<const Wrench<Space, double>> applied);

  /// Returns the wrench on the joint's second body at the joint's point: [moment; force] along the
  /// columns of `axes`, in ground axes. Excludes drives; NaN if not unique.
  Wrench<Space, double> Of(int joint, const Rotation<Space, double>& axes) const;

  /// Returns the effort of a prescribed motion along its coordinate: its power is effort times
  /// speed [N m or N]. NaN if not unique.
  double DriveOf(int joint, int coordinate) const;

  /// Returns the effort of a coupling along the coordinate of one of its joints, as above.
  double CouplingOf(int coupling, int part) const;

 private:
  struct Work;
  std::unique_ptr<Work> work_;
};

}  // namespace loopbench::harness
