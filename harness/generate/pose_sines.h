// Sine and cosine of the angle of a planar pose, with the bits that Kinematics gives it.
#pragma once

#include <cmath>

#include "mechanism/algebra/lanes.h"

namespace loopbench::generate {

/// Sine and cosine of one angle [rad].
inline void PoseSines(double angle, double* sine, double* cosine) {
  if (std::abs(angle) <= kLargestAngle) {
    SinCos(angle, *sine, *cosine);
  } else {
    *sine = std::sin(angle);
    *cosine = std::cos(angle);
  }
}

/// The same for kLanes angles.
inline void PoseLaneSines(const double* angles, double* sines, double* cosines) {
  const Lanes x = Load<Lanes>(angles);
  Lanes sine, cosine;
  SinCos(x, sine, cosine);
  Store(sine, sines);
  Store(cosine, cosines);
  if (!Any(~(Magnitude(x) <= kLargestAngle))) return;
  for (int lane = 0; lane < kLanes; ++lane) PoseSines(angles[lane], &sines[lane], &cosines[lane]);
}

}  // namespace loopbench::generate
