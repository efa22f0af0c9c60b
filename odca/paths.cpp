#include "odca/paths.h"

#include <utility>

namespace loopbench::odca {

std::vector<Path> FindPaths(int num_bodies, std::span<const PlanJoint> joints) {
  std::vector<int> to_ground(num_bodies, -1);
  for (int j = 0; j < static_cast<int>(joints.size()); ++j) {
    if (joints[j].from != 0 && joints[j].to != 0) continue;
    int& own = to_ground[joints[j].from + joints[j].to];
    if (own >= 0) return {};
    own = j;
  }
  const std::vector<int> none(num_bodies, 0);
  const BodyGraph graph(num_bodies, joints, none);
  std::vector<bool> seen(num_bodies, false);
  std::vector<Path> paths;
  int found = 1;  // Ground
  for (int first = 1; first < num_bodies; ++first) {
    if (graph.degree(first) > 2) return {};
    if (graph.degree(first) == 2 || seen[first]) continue;
    Path& path = paths.emplace_back();
    BodyGraph::End next = {.body = first, .joint = -1};
    for (int body = 0; next.body > 0; ++found) {
      body = std::exchange(next.body, 0);
      const int before = std::exchange(next.joint, -1);
      if (seen[body]) return {};
      seen[body] = true;
      path.push_back({body, before, to_ground[body]});
      for (const BodyGraph::End& end : graph.ends(body)) {
        if (end.joint != before) next = end;
      }
    }
  }
  if (found < num_bodies) return {};  // a ring
  return paths;
}

}  // namespace loopbench::odca
