// The user's own mechanism, nothing compiled away, put where its bodies are.
//
// What a trajectory says of joints, forces and energies is measured here, from the motion of bodies
// alone: the same functions serve a run of ours, whatever it was compiled to and integrated in, and
// the motion that another program says its bodies have.
#pragma once

#include <span>
#include <vector>

#include "harness/trajectory/body_motion.h"
#include "mechanism/model/kinematics.h"

namespace loopbench::harness {

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

}  // namespace loopbench::harness
