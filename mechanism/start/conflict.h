// Reasons for a failed assembly: names the joints in conflict.
#pragma once

#include <limits>
#include <string>
#include <vector>

#include "mechanism/model/kinematics.h"

namespace loopbench {

/// A free coordinate of a joint that is not in the tree.
struct OfCutJoint {
  int joint, component;
};

/// A message names an accuracy of the input that is larger than the stated one by less than this.
inline constexpr double kHintFactor = 100.0;

/// Residuals of a failed assembly: a number per constraint row, then one per coupling and one per
/// entry of `extra`.
struct UnsatisfiedConstraints {
  VectorX<double> rows;                ///< in units
  VectorX<double> units;               ///< [m] or [rad] each
  bool speeds = false;                 ///< of speeds: all of it per second
  std::vector<OfCutJoint> extra = {};  ///< fixed or given
  /// Accuracy of the input with which they are satisfied; the message names it if it is near.
  double accuracy = std::numeric_limits<double>::infinity();
};

/// Names the joints and couplings in conflict with their residuals and units, rods first, then the
/// largest. Also names joints of their loops that the assembly may not move: prescribed, fixed or
/// of given speed. At a least-squares solution the residuals e satisfy J^T e = 0. Joints with a
/// residual contradict each other; joints without one are not involved. Positions of `kinematics`
/// must belong to the residuals.
template <class Space>
std::string DescribeConflict(const MechanismDescription& description,
                             const Kinematics<Space, double>& kinematics,
                             const UnsatisfiedConstraints& unmet);

}  // namespace loopbench
