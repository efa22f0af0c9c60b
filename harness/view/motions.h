// Motions for a picture: each degree of freedom followed to and fro, with all loops closed again at
// every frame; and the pass of prescribed motions.
//
// A basis of the permitted speeds is chosen in which each motion moves one joint by one unit and
// stops those that the others begin with, so that each can be called by the name of a joint. A
// motion is then followed in small steps: a step along what the constraints leave of its last
// direction, and back onto the loops (excursion.h does the same to look for rank). Links keep their
// lengths to round-off. Where loops close no further the swing is shorter; where not even a first
// step is possible (speeds of a singular position that lead nowhere) bodies are moved along the
// speed itself by a small angle, and the text says so.
#pragma once

#include "harness/view/picture.h"
#include "mechanism/model/kinematics.h"

namespace loopbench::harness {

/// Of the bodies of a mechanism that was compiled from `description` as it is.
template <class Space>
Poses PosesOf(const MechanismDescription& description, const Kinematics<Space, double>& kinematics);

/// From the closed position q of a mechanism in joint coordinates. At most kMostMotions, and none
/// where the loops have more than kMostFollowed speeds; `left_out` says so in a sentence.
template <class Space>
std::vector<PictureMotion> FindMotions(const MechanismDescription& description,
                                       const Mechanism<Space, double>& mechanism,
                                       const VectorX<double>& q, std::string* left_out);

}  // namespace loopbench::harness
