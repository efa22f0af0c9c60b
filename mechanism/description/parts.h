// Parts of a description as descriptions of their own.
#pragma once

#include <vector>

#include "mechanism/description/islands.h"

namespace loopbench {

/// What became of the parts of a description: new indices, -1 for those that are gone.
struct Renumbering {
  std::vector<int> bodies, joints;
};

/// A part of a description: the bodies with index >= 0 in `bodies`, the joints likewise; forces,
/// initial values and names of independent speeds that belong to them. `renumbering` has the new
/// indices, in the old order.
MechanismDescription Select(const MechanismDescription& description,
                            const Renumbering& renumbering);

/// One island by itself, named "whole#1", "whole#2", .. (or as the whole, if it is the only one),
/// and where its bodies and joints are in the whole.
struct Part {
  MechanismDescription description;
  std::vector<int> bodies, joints;
};

/// `islands` are those that FindIslands() finds, of either connection.
std::vector<Part> Split(const MechanismDescription& description,
                        const std::vector<Island>& islands);

/// Each set of bodies that joints connect: for analyses of geometry, which springs between parts do
/// not concern. Of forces only those along joints are left, because a joint that has one stays in
/// the tree, and ranks belong to a tree.
std::vector<Part> SplitByJoints(MechanismDescription description);

}  // namespace loopbench
