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

/// By the names of bodies, Ground among them under "".
using BodyStarts = std::map<std::string, BodyStart>;

/// The assembled start; empty where it cannot be assembled, and `why` says why.
BodyStarts AssembledStart(const MechanismDescription& description, std::string* why);

/// Gives `changed` the places and motions of these bodies as initial values: each joint that is
/// followed has its coordinates and speeds, and parts that float have free joints named after their
/// bodies. What the joints of `changed` do not admit is assembled from there; of speeds then only
/// those stay that `changed` gave, and at last none.
///
/// "" or why there is no consistent start; `changed` is then unusable. Joints that were held stay
/// so where they are still followed.
std::string StartAt(const BodyStarts& starts, MechanismDescription* changed);

/// The description with the whole of its assembled start as initial values, consistent as they
/// stand; `why` says why there is none, and it is then returned as it is.
MechanismDescription WithAssembledStart(const MechanismDescription& description, std::string* why);

}  // namespace loopbench
