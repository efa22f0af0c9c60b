#include "mechanism/description/topology.h"

#include <algorithm>
#include <numeric>

namespace loopbench {

std::string_view ToString(Coordinates coordinates) {
  return coordinates == Coordinates::kJoint ? "joint" : "absolute";
}

namespace {

/// Sets of bodies already connected by chosen joints.
class DisjointSets {
 public:
  explicit DisjointSets(int n) : parent_(n) { std::iota(parent_.begin(), parent_.end(), 0); }
  int Find(int i) {
    while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
    return i;
  }
  bool Unite(int a, int b) {
    a = Find(a);
    b = Find(b);
    parent_[std::max(a, b)] = std::min(a, b);
    return a != b;
  }

 private:
  std::vector<int> parent_;
};

/// Low numbers prefer the tree. 0: follows a prescribed motion or a thread exactly there, 1: fixed,
/// 2: guessed, 3: carries a force, a rotor, a coupling or a speed, 4: neutral, 5: marked "cut".
std::vector<int> CutPreference(const MechanismDescription& description) {
  std::vector<int> preference(description.joints.size(), 4);
  const auto keep = [&](int joint) { preference[joint] = 3; };
  for (ForceDescription force : description.forces) {
    if (const int* joint = PartsOf(force).joint; joint != nullptr) keep(*joint);
  }
  for (const CouplingDescription& coupling : description.couplings) {
    for (const auto& [joint, ratio] : coupling.parts) keep(joint);
  }
  for (const JointValues& values : description.initial.speeds) keep(values.joint);
  for (const JointValues& values : description.initial.coordinates) preference[values.joint] = 2;
  for (int joint : description.initial.held) preference[joint] = 1;
  for (std::size_t i = 0; i < preference.size(); ++i) {
    const JointDescription& joint = description.joints[i];
    if (joint.rotor_inertia > 0.0) preference[i] = std::min(preference[i], 3);
    if (!joint.motions.empty() || TraitsOf(joint.type).cut_last) preference[i] = 0;
    if (joint.cut) preference[i] = 5;
  }
  return preference;
}

/// Kruskal's choice: joints in order of preference, those that would close a loop are left out.
std::vector<bool> ChooseTreeJoints(const MechanismDescription& description) {
  const std::vector<int> preference = CutPreference(description);
  std::vector<int> order(description.joints.size());
  std::iota(order.begin(), order.end(), 0);
  std::ranges::stable_sort(order, {}, [&](int j) { return preference[j]; });
  DisjointSets connected(static_cast<int>(description.bodies.size()));
  std::vector<bool> chosen(order.size(), false);
  for (int j : order) {
    const JointDescription& joint = description.joints[j];
    if (joint.type == JointType::kRod) continue;  // no coordinates to follow
    chosen[j] = connected.Unite(joint.from.body, joint.to.body);
  }
  return chosen;
}

}  // namespace

Topology BuildTopology(const MechanismDescription& description, Coordinates coordinates) {
  const int num_bodies = static_cast<int>(description.bodies.size());
  const int num_joints = static_cast<int>(description.joints.size());
  Topology topology;
  std::vector<bool> in_tree(num_joints, false);
  if (coordinates == Coordinates::kJoint) in_tree = ChooseTreeJoints(description);

  std::vector<std::vector<int>> joints_of(num_bodies);
  for (int j = 0; j < num_joints; ++j) {
    if (!in_tree[j]) {
      topology.constraints.push_back(j);
      continue;
    }
    joints_of[description.joints[j].from.body].push_back(j);
    joints_of[description.joints[j].to.body].push_back(j);
  }

  // Breadth first from Ground, then from the first body of each part not reached.
  std::vector<bool> reached(num_bodies, false);
  std::vector<int> queue;
  const auto reach_from = [&](int root) {
    reached[root] = true;
    queue.push_back(root);
    for (std::size_t k = queue.size() - 1; k < queue.size(); ++k) {
      const int parent = queue[k];
      for (int j : joints_of[parent]) {
        const JointDescription& joint = description.joints[j];
        const int child = joint.from.body == parent ? joint.to.body : joint.from.body;
        if (reached[child]) continue;
        reached[child] = true;
        topology.edges.push_back({j, parent, child});
        queue.push_back(child);
      }
    }
  };
  reach_from(kGround);
  for (int body = 1; body < num_bodies; ++body) {
    if (reached[body]) continue;
    topology.edges.push_back({-1, kGround, body});
    reach_from(body);
  }
  return topology;
}

/// The joint of each constraint is on a loop with the joints of both ways to where these meet.
std::vector<bool> OnLoops(const MechanismDescription& description, const Topology& topology) {
  std::vector<TreeEdge> edge_of(description.bodies.size());
  std::vector<int> depth(edge_of.size(), 0);
  std::vector<int> next(edge_of.size());  // towards Ground; skips edges that are on a loop
  std::iota(next.begin(), next.end(), 0);
  for (const TreeEdge& edge : topology.edges) {
    edge_of[edge.child] = edge;
    depth[edge.child] = depth[edge.parent] + 1;
  }
  const auto find = [&](int body) {
    while (next[body] != body) body = next[body] = next[next[body]];
    return body;
  };
  std::vector<bool> on_loops(description.joints.size(), false);
  for (const int j : topology.constraints) {
    on_loops[j] = true;
    int one = find(description.joints[j].from.body), other = find(description.joints[j].to.body);
    while (one != other) {
      if (depth[one] < depth[other]) std::swap(one, other);
      if (edge_of[one].joint >= 0) on_loops[edge_of[one].joint] = true;
      next[one] = edge_of[one].parent;
      one = find(one);
    }
  }
  return on_loops;
}

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
