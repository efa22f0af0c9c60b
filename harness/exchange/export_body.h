// What programs ask of a body's inertia, and its principal axes.
#pragma once

#include <Eigen/Core>
#include <string>

#include "harness/exchange/model.h"

namespace loopbench::exchange {

struct PrincipalInertia {
  Eigen::Vector3d moments;                             ///< [kg m^2]
  Eigen::Matrix3d axes = Eigen::Matrix3d::Identity();  ///< in body axes, right-handed
};

/// Of a planar body the moment about z for all three: of the others the motion says nothing. What
/// rounding takes from the triangle inequality is given back.
PrincipalInertia PrincipalInertiaOf(const Body& body, bool planar);

/// "" or: body "rod": moments of inertia 1, 1 and 3 kg m^2, which no body has.
std::string FaultOfInertia(const Body& body, bool planar);

}  // namespace loopbench::exchange
