// Connected components: the graph of bodies and joints without Ground.
#pragma once

#include <vector>

#include "mechanism/description/description.h"

namespace loopbench {

/// A set of bodies that are connected with each other, paths through Ground left out.
struct Island {
  std::vector<int> bodies;  ///< ascending, without Ground
  bool grounded = false;    ///< a joint leads to Ground; otherwise the part floats
};

/// Connections that put two bodies into one island. Couplings of joints count as forces.
enum class Connection { kJoints, kJointsAndForces };

/// Returns the islands in the order of their first bodies; each body except Ground is in just one.
///
/// User-defined forces are assumed to connect all bodies.
std::vector<Island> FindIslands(const MechanismDescription& description,
                                Connection connection = Connection::kJointsAndForces);

}  // namespace loopbench
