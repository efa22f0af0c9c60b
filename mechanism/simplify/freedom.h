// Admissible motions of a description at its start, weighted by kinetic energy.
//
// With N the speeds that all constraints permit (columns) and T(N x) = 1/2 x^T G x the kinetic
// energy of a permitted motion, prescribed ones at rest,
//
//   share of a body     the largest of its own energy over that of the whole, x^T G_b x / x^T G x,
//   mobility of a       r^T G^-1 r with r x the rate of its coordinate (elongation): the inverse of
//   spring              the mass that it feels, so that alone it swings at sqrt(stiffness
//   mobility).
// Dense: for analyses before a run.
#pragma once

#include <string>
#include <vector>

#include "mechanism/description/description.h"

namespace loopbench {

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
