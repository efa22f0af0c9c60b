// The same mechanism at another size.
#pragma once

#include "mechanism/description/description.h"

namespace loopbench {

/// All lengths times `factor` > 0, with gravity, forces and springs such that every angle moves in
/// time as before: masses stay, accelerations and forces scale with the factor, moments and
/// moments of inertia with its square. Coordinates of joints that are lengths, rods and pitches
/// scale too. What changes is how lengths compare with angles, with tolerances and with rounding.
MechanismDescription AtScale(const MechanismDescription& description, double factor);

}  // namespace loopbench
