// A mechanism as a model in plain numbers.
#pragma once

#include "harness/exchange/model.h"
#include "mechanism/description/description.h"

namespace loopbench::exchange {

/// With the tree and the order of Mechanism(description, Coordinates::kJoint), put where all
/// coordinates and speeds are zero. Model::missing then names prescribed motions, forces that
/// depend on time, drag, forces along the coordinate of a joint that closes a loop, joints and
/// forces of other programs.
Model MakeModel(const MechanismDescription& description);

/// The same at the assembled start. Throws std::runtime_error where it cannot be assembled.
Model MakeModelAtStart(const MechanismDescription& description);

}  // namespace loopbench::exchange
