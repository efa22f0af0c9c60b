// Paths of a mechanism: sequences in which each body has a joint to the previous and to the next
// one, and any body may have a joint to Ground. Chains, four-bars, ladders (crank, coupler, crank,
// ...) and arms are paths.
#pragma once

#include <vector>

#include "odca/body_graph.h"
#include "odca/plan.h"

namespace loopbench::odca {

struct PathBody {
  int body = 0;
  int before = -1;  ///< joint to the body before it, -1 for the first
  int ground = -1;  ///< joint to Ground, -1 without
};
using Path = std::vector<PathBody>;

/// Returns all bodies on paths, or none if bodies do not form paths: a body has joints to three
/// others, two to the same or two to Ground, or a ring is closed without an end.
std::vector<Path> FindPaths(int num_bodies, std::span<const PlanJoint> joints);

}  // namespace loopbench::odca
