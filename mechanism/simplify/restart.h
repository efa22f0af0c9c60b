// The start of a description, and a changed description that starts there.
#pragma once

#include <map>
#include <string>

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

}  // namespace loopbench
