// Redundant constraints: rows of J that depend on the others at every position.
//
// Bennett's linkage, a planar loop described in space and three cranks on one rod have such
// constraints. Their number is structural: the largest rank of J at admissible positions subtracted
// from the number of rows. Runs keep that rank at all positions (self_stress.h); as many rows as
// are redundant are *released*, so that every solver has independent rows. Which rows are released
// changes no result beyond round-off.
//
// Couplings stay imposed. If they depend on constraints of joints, these constraints are released:
// a crank and a rod of its length on a slide, with a gear of 2:1 between them, need no slide.
#pragma once

#include <string>
#include <vector>

#include "mechanism/model/mechanism.h"

namespace loopbench {

/// Common properties of several admissible positions.
struct Redundancy {
  /// Constrained directions of all cut joints, drives left free, and `num_couplings` couplings.
  int rows = 0, num_couplings = 0;
  int rank_at_start = 0;  ///< of those
  /// The largest rank found: the rank of generic positions. If all examined positions are singular,
  /// independent constraints are assumed.
  int rank = 0;
  /// rows - rank directions, in joints of the description; fewer where joints with prescribed
  /// coordinates would have to give them.
  std::vector<Released> released;
  std::vector<int> cut;                ///< joints that close loops: only these release
  std::vector<std::string> couplings;  ///< names; released constraints depend on them
  /// Independence of released constraints at the start [rad or lengths], if they are redundant only
  /// within the accuracy of the input: they are no constraints then. Otherwise 0.
  double rounding = 0.0;
};

/// Returns the sum over the parts of a description, each analysed separately. Only `cut` is known
/// of parts whose initial assembly fails, and of parts above kMaxAnalysedSpeeds unless all their
/// constraints are independent at the start (joint_response.h). Prescribed motions are left free:
/// their contradictions are not structural.
Redundancy FindRedundancy(const MechanismDescription& description);

/// A constrained direction of a joint in words: "the moment about x of its frame on rod", forces
/// along the axes that `released` counts them in.
std::string NameOfDirection(const MechanismDescription& description, const Released& released,
                            int direction);

/// The description with those directions released, and the same joints cut.
MechanismDescription Release(const MechanismDescription& description, const Redundancy& redundancy);

}  // namespace loopbench
