// Why a start could not be assembled: which joints cannot be met together, in words.
#pragma once

#include <string>
#include <vector>

#include "mechanism/model/kinematics.h"

namespace loopbench {

/// A free coordinate of a joint that is not in the tree.
struct OfCutJoint {
  int joint, component;
};

/// What an assembly could not bring to zero: a number per constraint row and, below them, one per
/// entry of `extra`.
struct Unmet {
  VectorX<double> rows;                ///< in units
  VectorX<double> units;               ///< [m] or [rad] each
  bool speeds = false;                 ///< of speeds: all of it per second
  std::vector<OfCutJoint> extra = {};  ///< held or given
};

/// Names the joints in conflict with the residual of each and its unit, rods first, then the
/// largest; and the joints of their loops that the assembly may not move: prescribed, held or of
/// given speed. At a least-squares solution the residuals e satisfy J^T e = 0: joints with a
/// residual pull against each other and cannot be met together, and joints without one are not
/// involved. Positions of `kinematics` must be those of the residuals.
template <class Space>
std::string DescribeConflict(const MechanismDescription& description,
                             const Kinematics<Space, double>& kinematics, const Unmet& unmet);

}  // namespace loopbench
