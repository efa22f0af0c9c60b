// Where a frame stands in another one, and the forms in which XML formats say orientations.
//
// Orientations are quaternions, so that a turn about one axis stays one to the last bit.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <numbers>
#include <string>

#include "mechanism/description/joint_frames.h"

namespace loopbench::harness {

inline constexpr double kDegree = std::numbers::pi / 180.0;  ///< [rad]

struct Placement {
  Placement() = default;
  explicit Placement(const Eigen::Vector3d& origin) : p(origin) {}
  Placement(const Eigen::Quaterniond& turn, const Eigen::Vector3d& origin) : q(turn), p(origin) {}

  Eigen::Quaterniond q = Eigen::Quaterniond::Identity();
  Eigen::Vector3d p = Eigen::Vector3d::Zero();

  /// X_AC from X_AB and X_BC.
  friend Placement operator*(const Placement& X_AB, const Placement& X_BC) {
    return {X_AB.q * X_BC.q, X_AB.p + X_AB.q * X_BC.p};
  }
  /// A point given in B, in A.
  Eigen::Vector3d At(const Eigen::Vector3d& point) const { return p + q * point; }
  Placement Inverse() const { return {q.conjugate(), q.conjugate() * Eigen::Vector3d(-p)}; }
  Frame AsFrame() const { return {q.toRotationMatrix(), p}; }
};

/// The rotation vector of a unit quaternion, at most half a turn [rad].
Eigen::Vector3d RotationVector(const Eigen::Quaterniond& q);

/// Rz(yaw) Ry(pitch) Rx(roll): the fixed-axes angles of URDF and SDF [rad].
Eigen::Quaterniond FromRollPitchYaw(const Eigen::Vector3d& angles);

/// Turns about axes one after the other: 'x', 'y', 'z' about those that turn with it, 'X', 'Y', 'Z'
/// about those that stand still (MJCF's eulerseq) [rad].
Eigen::Quaterniond FromEuler(const std::string& sequence, const Eigen::Vector3d& angles);

/// The shortest turn that takes z there; half a turn about x to the other side, as MuJoCo's.
Eigen::Quaterniond TurnOfZ(const Eigen::Vector3d& to);

/// An inertia in axes B, in axes A; q is R_AB. The same bits where they are parallel.
Eigen::Matrix3d InTurnedAxes(const Eigen::Quaterniond& q, const Eigen::Matrix3d& inertia);

/// The matrix with these elements, xx, yy, zz, xy, xz, yz.
Eigen::Matrix3d SymmetricMatrix(double xx, double yy, double zz, double xy, double xz, double yz);

}  // namespace loopbench::harness
