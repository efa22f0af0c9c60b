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

/// What a force connects.
struct Connects {
  Sets& sets;
  int num_bodies;

  void operator()(const JointTorque&) const {}  // along a joint, which connects anyway
  void operator()(const JointSpring&) const {}
  void operator()(const JointDamper&) const {}
  void operator()(const PointForce&) const {}  // on one body
  void operator()(const Drag&) const {}
  void operator()(const SpringDamper& force) const {
    if (force.from.body != kGround && force.to.body != kGround) {
      sets.Unite(force.from.body, force.to.body);
    }
  }
  /// Of forces not listed here nothing is known: they may connect all.
  template <class Other>
  void operator()(const Other&) const {
    for (int body = 2; body < num_bodies; ++body) sets.Unite(1, body);
  }
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
    const Connects connects{sets, num_bodies};
    for (const ForceDescription& force : description.forces) std::visit(connects, force);
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
