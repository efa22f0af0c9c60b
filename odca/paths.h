// Which bodies of a mechanism form paths: sequences in which each body has a joint to the one
// before and to the one after it, and any of them may have a joint to Ground. A chain is a path, a
// four-bar, a ladder (crank, coupler, crank, ...), an arm.
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

/// All bodies on paths, or none where bodies do not form paths: one has joints to three others, two
/// to the same or two to Ground, or a ring of them hangs nowhere open.
std::vector<Path> FindPaths(int num_bodies, std::span<const PlanJoint> joints);

}  // namespace loopbench::odca
