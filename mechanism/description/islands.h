// Which bodies have to do with each other: the graph of bodies and joints without Ground.
#pragma once

#include <vector>

#include "mechanism/description/description.h"

namespace loopbench {

/// A set of bodies that are connected with each other, paths through Ground left out.
struct Island {
  std::vector<int> bodies;  ///< ascending, without Ground
  bool grounded = false;    ///< a joint leads to Ground; otherwise the part floats
};

/// What makes two bodies one island.
enum class Connection { kJoints, kJointsAndForces };

/// The islands in the order of their first bodies; every body but Ground is in exactly one.
///
/// Forces that this file does not know are taken to connect all bodies.
std::vector<Island> FindIslands(const MechanismDescription& description,
                                Connection connection = Connection::kJointsAndForces);

}  // namespace loopbench
