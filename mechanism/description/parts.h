// Parts of a description as descriptions of their own.
#pragma once

#include <vector>

#include "mechanism/description/topology.h"

namespace loopbench {

/// New indices of a description's parts after a selection, -1 for removed ones.
struct Renumbering {
  std::vector<int> bodies, joints;
};

/// Returns a part of a description: the bodies and joints with index >= 0 in `bodies` and `joints`,
/// and their couplings, forces, initial values and names of independent speeds. Couplings keep all
/// of their joints or are left out. `renumbering` has the new
/// indices, in the old order.
MechanismDescription Select(const MechanismDescription& description,
                            const Renumbering& renumbering);

/// A separate island, named "whole#1", "whole#2", .. (or like the whole, if it is the only one),
/// and the indices of its bodies and joints in the whole.
struct Part {
  MechanismDescription description;
  std::vector<int> bodies, joints;
};

/// `islands` are those that FindIslands() finds, of either connection.
std::vector<Part> Split(const MechanismDescription& description,
                        const std::vector<Island>& islands);

/// Returns each set of bodies connected by joints, for analyses of geometry, which springs between
/// parts do not affect. Only forces along joints are kept, because their joints stay in the tree,
/// and ranks depend on the tree.
std::vector<Part> SplitByJoints(MechanismDescription description);

}  // namespace loopbench
