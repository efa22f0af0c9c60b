// What a mechanism does at one time, in the user's terms, whatever it was compiled to; and how far
// two such pictures are apart.
#pragma once

#include <Eigen/Geometry>
#include <vector>

#include "mechanism/simplify/compile.h"

namespace loopbench::harness {

/// Where a body is and how it moves, in the user's ground axes, at the body's origin.
struct BodyState {
  Frame pose;
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();          ///< [m/s]
  Eigen::Vector3d angular_velocity = Eigen::Vector3d::Zero();  ///< [rad/s]
};

struct Snapshot {
  std::vector<BodyState> bodies;  ///< by the user's body, Ground included
  /// By the user's joint: its coordinate [rad or m] where it has one, else NaN.
  std::vector<double> joints;
  std::vector<double> rates = {};  ///< of these coordinates; NaN where it was not taken
  double energy = 0.0;  ///< kinetic and potential [J]; NaN where it is not known of the whole
};

/// A point of a user's body, in its axes from its origin [m].
struct MeasuredPoint {
  std::size_t body = 0;
  Eigen::Vector3d at = Eigen::Vector3d::Zero();
};

/// A mechanism that is measured: the user's description and what became of it.
struct Measured {
  const MechanismDescription& user;
  const Compiled& compiled;
  /// Where distances of points are taken; none: at all of PointsOf().
  std::vector<MeasuredPoint> points = {};
};

/// Whether the first coordinate of a joint is a length, not an angle.
bool IsLength(const MechanismDescription& user, std::size_t joint);

/// Origins, centres of mass and named points of all bodies but Ground.
std::vector<MeasuredPoint> PointsOf(const MechanismDescription& user);

/// One with room for all bodies and joints: what is fixed to Ground is where it is, all else at the
/// origin.
Snapshot EmptySnapshot(const Measured& measured);

/// The same state of one part's body, at its centre of mass in the part's ground axes.
template <class Space, class S>
BodyState StateAtCentre(const Pose<Space, S>& pose, const Velocity<Space, S>& motion);

/// Enters a part's body, with all that is fixed to it.
void EnterBody(const Measured& measured, int part, int body, const BodyState& at_centre,
               Snapshot* snapshot);
/// Enters the coordinate of a joint of a part's description and its rate, which may be NaN.
void EnterJoint(const Measured& measured, int part, int joint, double coordinate, double rate,
                Snapshot* snapshot);

/// The picture of one part at `kinematics`, rounded to double; other parts stay as they are.
template <class Space, class S>
void TakeSnapshot(const Measured& measured, int part, const Kinematics<Space, S>& kinematics,
                  Snapshot* snapshot) {
  const Mechanism<Space, S>& mechanism = kinematics.mechanism();
  for (int body = 1; body < mechanism.num_bodies(); ++body) {
    const auto index = static_cast<std::size_t>(body);
    EnterBody(measured, part, body,
              StateAtCentre<Space, S>(kinematics.poses()[index], kinematics.motions()[index]),
              snapshot);
  }
  for (int j = 0; j < static_cast<int>(mechanism.joints().size()); ++j) {
    const auto& joint = mechanism.joints()[static_cast<std::size_t>(j)];
    if (joint.description < 0 || joint.kind->num_u != 1) continue;
    EnterJoint(measured, part, joint.description,
               static_cast<double>(kinematics.JointCoordinate(j)),
               static_cast<double>(kinematics.JointSpeed(j)), snapshot);
  }
  snapshot->energy = static_cast<double>(ComputeEnergy(kinematics).total());
}

/// The largest distances between two pictures of what belongs to one part (-1: to any).
struct Distance {
  double position = 0.0;          ///< of named points, origins and centres of mass [m]
  double rotation = 0.0;          ///< of bodies [rad]
  double velocity = 0.0;          ///< of the points [m/s]
  double angular_velocity = 0.0;  ///< [rad/s]
  double angle = 0.0;             ///< of joint coordinates [rad], without whole turns
  double displacement = 0.0;      ///< of joint coordinates [m]
  double energy = 0.0;            ///< [J]; NaN where one is not known
  /// By how much `a` is late on the way of `b`, to first order: least squares over the points, b's
  /// speeds as weights [s]; and the largest distance that is left [m]. NaN and the position where
  /// b stands still.
  double late = 0.0, shape = 0.0;
  double speed = 0.0;  ///< of b's points, root of the mean square [m/s]
};
Distance DistanceOf(const Measured& measured, int part, const Snapshot& a, const Snapshot& b);

/// The larger of each.
Distance Larger(const Distance& a, const Distance& b);

template <class Space, class S>
BodyState StateAtCentre(const Pose<Space, S>& pose, const Velocity<Space, S>& motion) {
  BodyState state;
  for (int i = 0; i < Space::kLin; ++i) {
    state.pose.p[i] = static_cast<double>(pose.p[i]);
    state.velocity[i] = static_cast<double>(motion.linear[i]);
    for (int j = 0; j < Space::kLin; ++j) state.pose.R(i, j) = static_cast<double>(pose.R(i, j));
  }
  for (int i = 0; i < Space::kRot; ++i) {
    state.angular_velocity[Space::kRot == 1 ? 2 : i] = static_cast<double>(motion.angular[i]);
  }
  return state;
}

}  // namespace loopbench::harness
