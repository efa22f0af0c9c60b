// A mechanism as a model in plain numbers.
#pragma once

#include "mechanism/description/description.h"
#include "peers/model.h"

namespace loopbench::peers {

/// With the tree and the order of Mechanism(description, Coordinates::kJoint). Throws NotThere for
/// what no peer has here: prescribed motions, forces that depend on time or turn with a body, drag,
/// forces along the coordinate of a joint that closes a loop, joints and forces of other programs.
Model MakeModel(const MechanismDescription& description);

}  // namespace loopbench::peers
