// Sine and cosine of the angle of a planar pose, with the bits that Kinematics gives it.
#pragma once

#include <cmath>

#include "mechanism/algebra/lanes.h"

namespace loopbench::generate {

inline void PoseSines(double angle, double* sine, double* cosine) {
  if (std::abs(angle) <= kLargestAngle) {
    SinCos(angle, *sine, *cosine);
  } else {
    *sine = std::sin(angle);
    *cosine = std::cos(angle);
  }
}

}  // namespace loopbench::generate
