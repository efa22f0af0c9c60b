#include "mechanism/description/topology.h"

#include <algorithm>
#include <utility>

namespace loopbench {

std::string_view ToString(Coordinates coordinates) {
  return coordinates == Coordinates::kJoint ? "joint" : "absolute";
}

namespace {

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

std::vector<Island> FindIslands(const MechanismDescription& description, Connection connection) {
  const int num_bodies = static_cast<int>(description.bodies.size());
  DisjointSets sets(num_bodies);
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

namespace {

/// Renumbers a force. False when there is nothing left for it to do.
bool Keep(const ForceParts& force, const Renumbering& renumbering) {
  if (force.joint != nullptr) {
    *force.joint = renumbering.joints[*force.joint];
    return *force.joint >= 0;
  }
  bool moves = false, lost = false;  // another part's
  for (BodyPoint* point : force.points) {
    point->body = renumbering.bodies[point->body];
    moves = moves || point->body > kGround;
    lost = lost || point->body < 0;
  }
  const bool on_itself = force.points.size() > 1 && force.points[0]->body == force.points[1]->body;
  return moves && !lost && !on_itself;
}

/// Returns the names of independent speeds if all still exist, else none.
std::vector<std::string> KeptNames(const MechanismDescription& old, const Renumbering& kept) {
  for (const std::string& name : old.independent) {
    const std::string owner = name.substr(0, name.rfind('.'));
    for (std::size_t i = 0; i < old.bodies.size(); ++i) {
      if (old.bodies[i].name == owner && kept.bodies[i] < 0) return {};
    }
    for (std::size_t j = 0; j < old.joints.size(); ++j) {
      if ((old.joints[j].name == name || old.joints[j].name == owner) && kept.joints[j] < 0) {
        return {};
      }
    }
  }
  return old.independent;
}

std::vector<JointValues> KeptValues(const std::vector<JointValues>& old, const Renumbering& kept) {
  std::vector<JointValues> values;
  for (const JointValues& one : old) {
    if (kept.joints[one.joint] >= 0) {
      values.push_back({kept.joints[one.joint], one.values, one.weight});
    }
  }
  return values;
}

}  // namespace

MechanismDescription Select(const MechanismDescription& description,
                            const Renumbering& renumbering) {
  // A new member of the description must be thought about here: this line stops compiling.
  const auto& [name, space, gravity, bodies, joints, couplings, forces, initial, independent,
               accuracy, rounded] = description;
  MechanismDescription part;
  part.name = name;
  part.space = space;
  part.accuracy = accuracy;
  part.rounded = rounded;
  part.gravity = gravity;
  part.bodies.clear();
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    if (renumbering.bodies[i] >= 0) part.bodies.push_back(bodies[i]);
  }
  for (std::size_t j = 0; j < joints.size(); ++j) {
    if (renumbering.joints[j] < 0) continue;
    // Add new members of a joint here; they must stay valid if its frames' bodies change.
    const auto& [joint_name, type, from, to, axis, parameter, cut, released, moving, motions,
                 rotor_inertia] = joints[j];
    JointDescription joint{joint_name, type,     from,   to,      axis,         parameter,
                           cut,        released, moving, motions, rotor_inertia};
    joint.from.body = renumbering.bodies[from.body];
    joint.to.body = renumbering.bodies[to.body];
    part.joints.push_back(joint);
  }
  for (CouplingDescription coupling : couplings) {
    bool is_kept = true;
    for (auto& [joint, ratio] : coupling.parts) {
      joint = renumbering.joints[joint];
      is_kept = is_kept && joint >= 0;
    }
    if (is_kept) part.couplings.push_back(std::move(coupling));
  }
  for (ForceDescription force : forces) {
    if (Keep(PartsOf(force), renumbering)) part.forces.push_back(force);
  }
  part.initial.coordinates = KeptValues(initial.coordinates, renumbering);
  part.initial.speeds = KeptValues(initial.speeds, renumbering);
  for (const int joint : initial.held) {
    if (renumbering.joints[joint] >= 0) part.initial.held.push_back(renumbering.joints[joint]);
  }
  part.independent = KeptNames(description, renumbering);
  return part;
}

std::vector<Part> Split(const MechanismDescription& description,
                        const std::vector<Island>& islands) {
  if (islands.size() == 1) {
    Part whole{description, std::vector<int>(description.bodies.size()),
               std::vector<int>(description.joints.size())};
    std::iota(whole.bodies.begin(), whole.bodies.end(), 0);
    std::iota(whole.joints.begin(), whole.joints.end(), 0);
    return {whole};
  }
  std::vector<Part> parts;
  for (const Island& island : islands) {
    Part part;
    Renumbering own{std::vector<int>(description.bodies.size(), -1),
                    std::vector<int>(description.joints.size(), -1)};
    const auto take = [](int index, std::vector<int>& numbers, std::vector<int>& taken) {
      numbers[index] = static_cast<int>(taken.size());
      taken.push_back(index);
    };
    take(kGround, own.bodies, part.bodies);
    for (const int body : island.bodies) take(body, own.bodies, part.bodies);
    for (std::size_t j = 0; j < description.joints.size(); ++j) {
      const auto& [from, to] =
          std::pair(description.joints[j].from.body, description.joints[j].to.body);
      if (own.bodies[from == kGround ? to : from] > kGround) {
        take(static_cast<int>(j), own.joints, part.joints);
      }
    }
    part.description = Select(description, own);
    part.description.name += "#" + std::to_string(parts.size() + 1);
    parts.push_back(std::move(part));
  }
  return parts;
}

std::vector<Part> SplitByJoints(MechanismDescription description) {
  // forces along joints stay: they decide which joints are coordinates, and with them the rank
  std::erase_if(description.forces,
                [](ForceDescription& force) { return PartsOf(force).joint == nullptr; });
  return Split(description, FindIslands(description));
}

}  // namespace loopbench
