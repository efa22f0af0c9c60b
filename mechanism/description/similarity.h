// A mechanism scaled to another size.
#pragma once

#include "mechanism/description/description.h"

namespace loopbench {

/// Scales all lengths by `factor` > 0, with gravity, forces and springs such that every angle keeps
/// its motion in time. Masses stay, accelerations and forces scale with the factor, moments and
/// moments of inertia with its square. Joint coordinates that are lengths, rods and pitches scale
/// too. Only the ratios of lengths to angles, tolerances and rounding change.
MechanismDescription AtScale(const MechanismDescription& description, double factor);

}  // namespace loopbench
