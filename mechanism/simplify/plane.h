// Spatial descriptions that are planar: every joint lets its bodies move only in planes normal to
// one common direction n, and every body is held to ground through such joints.
//
// Then each body keeps its height along n and turns about n only, and the same motion follows from
// a planar description in axes with z = n. What acts along n, and moments across it, only loads the
// bearings: it does no work and is dropped. Products of inertia do so too.
//
// Which joints qualify: revolute with its axis along n, prismatic with its axis across n,
// pin-in-slot and planar with their normal along n, weld. All others do not, those that this code
// does not know included; nor does a mechanism in which nothing turns, since n is open then.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "mechanism/simplify/attach.h"

namespace loopbench {

struct InPlane {
  MechanismDescription description;  ///< planar; bodies and joints keep their order and names
  Eigen::Matrix3d R_WC = Eigen::Matrix3d::Identity();  ///< its ground axes in the user's; z is n
  std::vector<Frame> X_CB;            ///< the user's body axes and origin in the new ones
  std::vector<bool> mirrored;         ///< joints whose angle (and y) changed sign: their z was -n
  double gravity_dropped = 0.0;       ///< gravity along n [m/s^2]
  std::vector<double> force_dropped;  ///< of each force, its part along n [N]
};

/// How parallel axes must be, as the sine of the angle, and how level bodies, over the arms'
/// length: what rounding leaves of a description turned in space.
inline constexpr double kParallel = 1e-12;

/// Axes with z = n, x as near to the old x (or y) as that allows; unchanged when n is z.
Eigen::Matrix3d AxesWithNormal(const Eigen::Vector3d& n);

/// Nothing when the description is planar already or does not qualify; `why` then says what was
/// met.
std::optional<InPlane> ExpressInPlane(const MechanismDescription& description, std::string* why);

}  // namespace loopbench
