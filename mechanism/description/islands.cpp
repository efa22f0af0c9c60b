#include "mechanism/description/islands.h"

#include <numeric>

namespace loopbench {

namespace {

class Sets {
 public:
  explicit Sets(std::size_t n) : parent_(n) { std::iota(parent_.begin(), parent_.end(), 0); }
  int Find(int i) {
    while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
    return i;
  }
  void Unite(int a, int b) { parent_[Find(a)] = Find(b); }

 private:
  std::vector<int> parent_;
};

}  // namespace

std::vector<Island> FindIslands(const MechanismDescription& description, Connection connection) {
  const int num_bodies = static_cast<int>(description.bodies.size());
  Sets sets(description.bodies.size());
  for (const JointDescription& joint : description.joints) {
    if (joint.from.body != kGround && joint.to.body != kGround) {
      sets.Unite(joint.from.body, joint.to.body);
    }
  }
  if (connection == Connection::kJointsAndForces) {
    for (ForceDescription force : description.forces) {
      const std::vector<BodyPoint*> points = PartsOf(force).points;
      if (points.size() < 2 || points[0]->body == kGround || points[1]->body == kGround) continue;
      sets.Unite(points[0]->body, points[1]->body);
    }
  }
  for (const CouplingDescription& coupling : description.couplings) {
    int last = kGround;
    for (const auto& [joint, ratio] : coupling.parts) {
      const JointDescription& one = description.joints[joint];
      const int body = one.to.body != kGround ? one.to.body : one.from.body;
      if (connection == Connection::kJointsAndForces && last != kGround) sets.Unite(last, body);
      last = body;
    }
  }
  std::vector<Island> islands;
  std::vector<int> island_of_root(description.bodies.size(), -1);
  for (int body = 1; body < num_bodies; ++body) {
    int& island = island_of_root[sets.Find(body)];
    if (island < 0) {
      island = static_cast<int>(islands.size());
      islands.emplace_back();
    }
    islands[island].bodies.push_back(body);
  }
  for (const JointDescription& joint : description.joints) {
    const bool from_ground = joint.from.body == kGround, to_ground = joint.to.body == kGround;
    if (from_ground == to_ground) continue;
    islands[island_of_root[sets.Find(from_ground ? joint.to.body : joint.from.body)]].grounded =
        true;
  }
  return islands;
}

}  // namespace loopbench
