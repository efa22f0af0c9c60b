// The ideas that change the motion, a file each. What they return is said in model.h.
#pragma once

#include "mechanism/simplify/model.h"

namespace loopbench {

/// Bodies whose joints have hardly moved in the short run become one, as they stand at the start;
/// those that hang so on Ground become part of it. Joints with given motions are none.
Simplified FreezeConstantParts(const MechanismDescription& description, const ShortRun& run,
                               const SimplifyOptions& options);

/// A stiff spring between two points becomes a rod as long as the spring is where it is free; one
/// in a joint holds the joint there, and the two bodies become one. Its damper goes with it. The
/// frequency is that at which it swings alone (freedom.h); the rate of the motion is that of the
/// start or of the short run, or the highest frequency of the springs that are not stiff.
Simplified HoldStiffSprings(const MechanismDescription& description, const ShortRun& run,
                            const SimplifyOptions& options);

/// A body with two pins and nothing else, in the plane, or with two spherical joints (or one and a
/// universal joint) in space, becomes a rod of its name, the lightest first. Its named points at
/// the pins stay as points "<body>.<point>" of the bodies there. Where the rod joins two bodies
/// that nothing else carries, they float on free joints.
Simplified LightenLinks(const MechanismDescription& description, const ShortRun& run,
                        const SimplifyOptions& options);

/// A spatial description as plane.h makes a planar one, but of what is planar only nearly, and at
/// the start: axes that are nearly normal (or parallel) to the plane are taken to be so, spherical
/// and universal joints turn about its normal, heights stay as they are at the start.
Simplified FlattenNearly(const MechanismDescription& description, const ShortRun& run,
                         const SimplifyOptions& options);

}  // namespace loopbench
