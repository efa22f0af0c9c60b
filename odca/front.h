// The rule that lets one assembly take body after body (join_order.h).
#pragma once

#include <span>
#include <vector>

#include "odca/body_graph.h"
#include "odca/pairing.h"

namespace loopbench::odca {

/// Joins a connected set of bodies to one growing assembly, the front. Each time the neighbour
/// enters that leaves the smallest boundary. Among equals it is the one with most joints, so that
/// hubs enter before the bodies that stand between them. The front begins at `start`, if that body
/// is in the set. The set is given by `marks->part_of`,
/// which must be negative for all other bodies.
JoinSum JoinToFront(const BodyGraph& graph, std::span<const int> bodies, int dim, BodyMarks* marks,
                    std::vector<Join>* joins, int start = 0);

}  // namespace loopbench::odca
