// The start of a description, and a changed description that starts there.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "mechanism/description/joint_frames.h"

namespace loopbench {

/// Place and motion of a body at its origin, ground axes.
struct BodyStart {
  Frame X;
  double angle = 0.0;                           ///< plane: a number, not modulo a turn
  Eigen::Vector3d w = Eigen::Vector3d::Zero();  ///< angular velocity [rad/s]
  Eigen::Vector3d v = Eigen::Vector3d::Zero();  ///< velocity of the origin [m/s]
};

/// Starts by body name, with Ground under "".
using BodyStarts = std::map<std::string, BodyStart>;

/// Returns the assembled start; if assembly fails, returns an empty one and the reason in `why`.
BodyStarts AssembledStart(const MechanismDescription& description, std::string* why);

/// Appends `ending` to the name until no joint has it.
std::string UnusedJointName(const MechanismDescription& description, std::string name,
                            const std::string& ending);

/// Gives `changed` the poses and motions of these bodies as initial values: all followed joints get
/// coordinates and speeds; floating parts get free joints named after their bodies. Assembly
/// corrects values that the joints of `changed` do not admit; then only speeds given in `changed`
/// stay, and finally none.
///
/// Returns "" or the reason why there is no consistent start; `changed` is then unusable. Fixed
/// joints stay fixed if they are still followed.
std::string StartAt(const BodyStarts& starts, MechanismDescription* changed);

/// Returns the description with its complete assembled start as consistent initial values. If
/// assembly fails, returns the description unchanged and the reason in `why`.
MechanismDescription WithAssembledStart(const MechanismDescription& description, std::string* why);

// Admissible motions of a description at its start, weighted by kinetic energy.
//
// With N the speeds that all constraints permit (columns) and T(N x) = 1/2 x^T G x the kinetic
// energy of a permitted motion, prescribed ones at rest,
//
//   share of a body     the largest of its own energy over that of the whole, x^T G_b x / x^T G x,
//   mobility of a       r^T G^-1 r with r x the rate of its coordinate (elongation): the inverse of
//   spring              the mass that it feels; alone it swings at sqrt(stiffness mobility).
// Dense: for analyses before a run.

struct Freedom {
  std::string why;      ///< why nothing is known; else empty
  int speeds = 0;       ///< independent permitted ones
  double length = 1.0;  ///< the mechanism's own [m]
  double rate = 0.0;    ///< of the motion at the start, see below [rad/s]
  /// Shares of kinetic energy by body, for motions with prescribed ones free; 0 if nothing moves.
  std::vector<double> shares;
  std::vector<double> mobility;  ///< by force: [1/(kg m^2)] or [1/kg]; 0 if not a spring
  std::vector<double> travel;    ///< by force: a spring's coordinate less its free one
};

/// `rate` is the largest of: angular speeds of bodies, speeds of their centres of mass over the
/// length, angular frequencies of prescribed motions, and the pendulum frequency of the mechanism's
/// length, sqrt(g / length).
Freedom MeasureFreedom(const MechanismDescription& description);

/// Returns joints that no admissible speed moves at the start; joints with prescribed motions count
/// as free. All false if unknown.
std::vector<bool> FindStill(const MechanismDescription& description);

/// Returns the coordinate at which a spring has no force: rest + preload / stiffness, a joint's
/// coordinate or a distance. The stiffness must not be zero.
double FreeCoordinate(const JointSpring& spring);
double FreeCoordinate(const SpringDamper& spring);

}  // namespace loopbench
