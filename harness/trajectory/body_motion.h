// Where a user's body is and how it moves, whatever the mechanism was compiled to.
#pragma once

#include <Eigen/Geometry>
#include <span>
#include <vector>

#include "mechanism/simplify/compile.h"

namespace loopbench::harness {

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

}  // namespace loopbench::harness
