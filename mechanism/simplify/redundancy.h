// Constraints that say at every position what the others say, and which of them are not imposed.
//
// Bennett's linkage, a planar loop described in space, three cranks on one rod: their constraints
// depend on each other wherever they stand. Imposed all the same, and shared out by a solver that
// reveals rank at each position anew, the neglected combination turns with the position, and a
// mismatch e of it obeys e'' = k(t) e: drift grows exponentially below level `position`. So as many
// directions as are redundant at generic positions are *released*: left out of the equations, in
// the joint's own axes, where each of them stays one and the same function of the coordinates. What
// is left is the same mechanism with its redundancy modelled away, and its drift grows as t^2.
// Released directions are observed as all others are.
//
// A choice that is well conditioned at one position may be badly conditioned at another. Of several
// positions the worst counts; the best choice is reviewed at accepted steps (release_review.h).
#pragma once

#include <string>
#include <vector>

#include "mechanism/model/mechanism.h"

namespace loopbench {

/// What several admissible positions have in common.
struct Redundancy {
  int rows = 0;           ///< constrained directions of all cut joints, drives left free
  int rank_at_start = 0;  ///< of those
  /// The largest rank met: that of generic positions. Where positions are singular as far as one
  /// looks, independent constraints are assumed.
  int rank = 0;
  /// rows - rank directions, in joints of the description; fewer where joints with prescribed
  /// coordinates would have to give them.
  std::vector<Released> released;
  std::vector<int> cut;  ///< joints that close loops: only these release
};

/// The sum over the parts of a description, each looked at by itself. Of parts whose start cannot
/// be assembled, and of those above kMostAnalysedSpeeds unless all their constraints are
/// independent at the start (joint_response.h), only `cut` is known. Prescribed motions
/// are left free: what they contradict is no matter of structure.
Redundancy FindRedundancy(const MechanismDescription& description);

/// A constrained direction of a joint in words: "the moment about x of its frame on rod", forces
/// along the axes that `released` counts them in.
std::string NameOfDirection(const MechanismDescription& description, const Released& released,
                            int direction);

/// The description with those directions released, and the same joints cut.
MechanismDescription Release(const MechanismDescription& description, const Redundancy& redundancy);

}  // namespace loopbench
