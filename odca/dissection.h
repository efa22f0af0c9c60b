// Cut of a connected set of bodies into two (join_order.h).
#pragma once

#include <span>
#include <vector>

#include "odca/body_graph.h"

namespace loopbench::odca {

/// The bodies on one side of the best cut found through the connected set `bodies`; empty for sets
/// too small to cut. `place[body]` is the body's position in `bodies`, -1 outside the set.
///
/// Distances are counted in joints within the set. Landmarks are as far as possible from a body and
/// then from each other; the difference of the distances to two of them orders the set, and a cut
/// is a place in such an order (Harel and Koren 2002 draw graphs by such coordinates). The best has
/// the least quotient of constraint rows across it by bodies on its smaller side (Leighton and Rao
/// 1999), which has a quarter of the bodies at least.
std::vector<int> BestSide(const BodyGraph& graph, std::span<const int> bodies,
                          std::span<const int> place);

}  // namespace loopbench::odca
