// Sines and cosines of a list of angles, side by side.
#pragma once

#include "mechanism/algebra/lanes.h"

namespace loopbench::odca {

/// Computes sines and cosines of `count` angles [rad], a multiple of kLanes. Returns false if an
/// angle is beyond kLargestAngle or NaN.
LOOPBENCH_INLINE bool SinesAndCosines(const double* angles, int count, double* sines,
                                      double* cosines) {
  Lanes room = Lanes{} + kLargestAngle;
  for (int i = 0; i < count; i += kLanes) {
    const Lanes angle = Load<Lanes>(angles + i);
    room = Min(room, kLargestAngle - Magnitude(angle));
    Lanes s, c;
    SinCos(angle, s, c);
    Store(s, sines + i);
    Store(c, cosines + i);
  }
  return Smallest(room) >= 0.0;
}

}  // namespace loopbench::odca
