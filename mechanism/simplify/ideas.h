// The approximate simplification rules, a file each. Return values: model.h.
#pragma once

#include "mechanism/simplify/model.h"

namespace loopbench {

/// Merges bodies whose joints have hardly moved in the short run, in their initial poses, also with
/// Ground. Joints with prescribed motions are excluded.
Simplified FreezeConstantParts(const MechanismDescription& description, const ShortRun& run,
                               const SimplifyOptions& options);

/// Replaces a stiff spring between two points by a rod of its free length. A stiff joint spring
/// fixes its joint, and the two bodies become one. Its damper is removed. The frequency is its
/// natural frequency alone (freedom.h). The rate of the motion is taken from the start or the short
/// run, or is the highest frequency of the springs that are not stiff.
Simplified HoldStiffSprings(const MechanismDescription& description, const ShortRun& run,
                            const SimplifyOptions& options);

/// Replaces a planar body with only two pins, or a spatial body with only two spherical joints (or
/// one and a universal joint), by a rod of its name, the lightest first. Its named points at the
/// pins stay as points "<body>.<point>" of the bodies there. If nothing else carries the two bodies
/// of the rod, they float on free joints.
Simplified LightenLinks(const MechanismDescription& description, const ShortRun& run,
                        const SimplifyOptions& options);

/// Makes a nearly planar spatial description planar at its start (exactly planar ones: plane.h).
/// Axes nearly normal (or parallel) to the plane are taken as exact, spherical and universal joints
/// turn about its normal, heights keep their initial values.
Simplified FlattenNearly(const MechanismDescription& description, const ShortRun& run,
                         const SimplifyOptions& options);

}  // namespace loopbench
