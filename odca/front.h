// The rule that lets one assembly take body after body (join_order.h).
#pragma once

#include <span>
#include <vector>

#include "odca/body_graph.h"
#include "odca/pairing.h"

namespace loopbench::odca {

/// Joins a connected set of bodies to one growing assembly, each time the neighbour that leaves the
/// smallest boundary; of equals the one with most joints, so that hubs come before what stands
/// between them. `marks->part_of` is not negative for the set alone.
JoinSum JoinToFront(const BodyGraph& graph, std::span<const int> bodies, int dim, BodyMarks* marks,
                    std::vector<Join>* joins);

}  // namespace loopbench::odca
