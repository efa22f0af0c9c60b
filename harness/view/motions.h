// Motions for a picture: each degree of freedom swings to and fro with all loops closed in every
// frame. Prescribed motions run once.
//
// In the chosen basis of admissible speeds each motion moves one joint by one unit and stops the
// leading joints of the other motions. Each motion is therefore named after a joint. A motion is
// followed in small steps: a step along the projection of its last direction, then a position
// projection onto the loops (excursion.h finds ranks in the same way). Links keep their lengths to
// round-off. The swing ends early if the loops cannot close. If even the first step fails (speeds
// of a singular configuration without a finite motion), bodies move along the speed itself by a
// small angle, and the text states this.
#pragma once

#include "harness/view/picture.h"
#include "mechanism/model/kinematics.h"

namespace loopbench::harness {

/// Returns the poses of the bodies of a mechanism that was compiled from `description` unchanged.
template <class Space>
Poses PosesOf(const MechanismDescription& description, const Kinematics<Space, double>& kinematics);

/// Finds at most kMaxMotions motions from the closed position q in joint coordinates; none for
/// loops with more than kMaxFollowed speeds. `left_out` gives the reason.
template <class Space>
std::vector<PictureMotion> FindMotions(const MechanismDescription& description,
                                       const Mechanism<Space, double>& mechanism,
                                       const VectorX<double>& q, std::string* left_out);

}  // namespace loopbench::harness
