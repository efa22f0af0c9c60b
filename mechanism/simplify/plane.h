// Spatial descriptions that are planar: every joint lets its bodies move only in planes normal to
// one common direction n, and connects every body to ground by such joints.
//
// Then each body keeps its height along n and turns about n only. A planar description in axes with
// z = n has the same motion. Forces along n, moments across it and products of inertia only load
// the bearings: they do no work and are dropped.
//
// Qualifying joints: revolute with its axis along n, prismatic with its axis across n, pin-in-slot
// and planar with their normal along n, weld. All others, including user-defined ones, do not
// qualify; nor does a mechanism without rotation, since n is undetermined.
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

/// Tolerance of parallel axes (sine of the angle) and of body heights (over the arms' length):
/// rounding of a description turned in space.
inline constexpr double kParallel = 1e-12;

/// Axes with z = n, x as near to the old x (or y) as that allows; unchanged when n is z.
Eigen::Matrix3d AxesWithNormal(const Eigen::Vector3d& n);

/// Returns nothing if the description is planar already or does not qualify; `why` then gives the
/// reason.
std::optional<InPlane> ExpressInPlane(const MechanismDescription& description, std::string* why);

}  // namespace loopbench
