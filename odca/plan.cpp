#include "odca/plan.h"

#include <algorithm>
#include <map>
#include <set>

namespace loopbench::odca {

namespace {

/// A PlanNode that owns its lists.
struct Draft {
  PlanNode node;
  std::vector<Handle> handles;
  std::vector<int> kept;
  std::vector<NodeJoint> joints;
};

/// An assembly while the tree is grown.
struct Assembly {
  int node = 0;
  std::vector<int> boundary;  ///< bodies with joints still to come, in order of entry
  std::map<int, std::vector<int>> neighbours;  ///< other assembly -> joints between
  std::vector<int> ground_joints;              ///< to Ground, still to come
  bool reaches_ground = false;
  bool alive = true;
};

class Planner {
 public:
  Planner(int num_bodies, std::span<const PlanJoint> joints, const PlanOptions& options)
      : joints_(joints), options_(options), open_joints_(num_bodies, 0) {
    assemblies_.resize(num_bodies - 1);
    for (int a = 0; a < num_bodies - 1; ++a) {
      assemblies_[a].node = a;
      assemblies_[a].boundary = {a + 1};
    }
    for (int j = 0; j < static_cast<int>(joints.size()); ++j) {
      const int from = joints[j].from, to = joints[j].to;
      ++open_joints_[from];
      ++open_joints_[to];
      if (from == 0 || to == 0) {
        assemblies_[std::max(from, to) - 1].ground_joints.push_back(j);
      } else {
        assemblies_[from - 1].neighbours[to - 1].push_back(j);
        assemblies_[to - 1].neighbours[from - 1].push_back(j);
      }
    }
  }

  std::vector<Draft> Run() {
    GroundLeaves();
    while (PairOnce()) {
    }
    for (Assembly& assembly : assemblies_) {
      if (assembly.alive && !assembly.ground_joints.empty()) Ground(assembly);
    }
    return DepthFirst();
  }

 private:
  /// Number of joints to Ground in the connected part of each assembly.
  std::vector<int> GroundJointsOfPart() const {
    std::vector<int> part(assemblies_.size(), -1), count;
    for (std::size_t root = 0; root < assemblies_.size(); ++root) {
      if (part[root] >= 0) continue;
      std::vector<std::size_t> stack = {root};
      part[root] = static_cast<int>(count.size());
      count.push_back(0);
      while (!stack.empty()) {
        const Assembly& assembly = assemblies_[stack.back()];
        const int mine = part[stack.back()];
        stack.pop_back();
        count[mine] += static_cast<int>(assembly.ground_joints.size());
        for (const auto& [other, list] : assembly.neighbours) {
          if (part[other] < 0) {
            part[other] = mine;
            stack.push_back(other);
          }
        }
      }
    }
    std::vector<int> result(assemblies_.size());
    for (std::size_t a = 0; a < result.size(); ++a) result[a] = count[part[a]];
    return result;
  }

  void GroundLeaves() {
    const std::vector<int> in_part = GroundJointsOfPart();
    for (std::size_t a = 0; a < assemblies_.size(); ++a) {
      const bool wait = options_.grounding == Grounding::kAtRoot && in_part[a] <= 2;
      if (!wait && !assemblies_[a].ground_joints.empty()) Ground(assemblies_[a]);
    }
  }

  /// Bodies of the boundary once the given joints are closed.
  int BoundaryAfter(const Assembly& a, const Assembly& b, const std::vector<int>& closed) const {
    std::map<int, int> closing;
    for (int j : closed) {
      ++closing[joints_[j].from];
      ++closing[joints_[j].to];
    }
    int count = 0;
    for (const Assembly* side : {&a, &b}) {
      for (int body : side->boundary) {
        const auto it = closing.find(body);
        count += open_joints_[body] > (it == closing.end() ? 0 : it->second);
      }
    }
    return count;
  }

  bool PairOnce() {
    struct Pair {
      int cost, a, b;
      auto operator<=>(const Pair&) const = default;
    };
    std::vector<Pair> pairs;
    for (int a = 0; a < static_cast<int>(assemblies_.size()); ++a) {
      if (!assemblies_[a].alive) continue;
      for (const auto& [b, list] : assemblies_[a].neighbours) {
        if (a < b) pairs.push_back({BoundaryAfter(assemblies_[a], assemblies_[b], list), a, b});
      }
    }
    std::ranges::sort(pairs);
    std::vector<bool> taken(assemblies_.size(), false);
    for (const Pair& pair : pairs) {
      if (taken[pair.a] || taken[pair.b]) continue;
      taken[pair.a] = taken[pair.b] = true;
      Merge(pair.a, pair.b);
    }
    return !pairs.empty();
  }

  void Merge(int a, int b) {
    const std::vector<int> between = assemblies_[a].neighbours[b];
    const std::size_t at_once = options_.closing == Closing::kTogether ? between.size() : 1;
    AddNode(assemblies_[a], &assemblies_[b], {between.begin(), between.begin() + at_once});
    for (std::size_t k = at_once; k < between.size(); ++k) {
      AddNode(assemblies_[a], nullptr, {between[k]});
    }
    assemblies_[a].neighbours.erase(b);
    assemblies_[b].neighbours.erase(a);
    for (const auto& [other, list] : assemblies_[b].neighbours) {
      std::vector<int>& mine = assemblies_[a].neighbours[other];
      mine.insert(mine.end(), list.begin(), list.end());
      assemblies_[other].neighbours.erase(b);
      assemblies_[other].neighbours[a] = mine;
    }
    assemblies_[b].neighbours.clear();
    assemblies_[b].alive = false;
  }

  void Ground(Assembly& assembly) {
    const std::vector<int> list = std::move(assembly.ground_joints);
    assembly.ground_joints.clear();
    if (options_.closing == Closing::kTogether) {
      AddNode(assembly, nullptr, list);
    } else {
      for (int j : list) AddNode(assembly, nullptr, {j});
    }
  }

  /// Appends the node that closes `list` and turns `a` into the result.
  void AddNode(Assembly& a, Assembly* b, const std::vector<int>& list) {
    Draft draft;
    PlanNode& node = draft.node;
    node.children[0] = a.node;
    node.children[1] = b != nullptr ? b->node : -1;
    for (int child = 0; child < (b != nullptr ? 2 : 1); ++child) {
      const std::vector<int>& boundary = child == 0 ? a.boundary : b->boundary;
      for (int place = 0; place < static_cast<int>(boundary.size()); ++place) {
        draft.handles.push_back({boundary[place], child, place, false});
      }
    }
    const auto place_of = [&](int body) {
      const auto it = std::ranges::find(draft.handles, body, &Handle::body);
      return it == draft.handles.end() ? -1 : static_cast<int>(it - draft.handles.begin());
    };
    bool touches_ground = false;
    for (int j : list) {
      const PlanJoint& joint = joints_[j];
      --open_joints_[joint.from];
      --open_joints_[joint.to];
      draft.joints.push_back({joint.index, joint.rows, place_of(joint.from), place_of(joint.to)});
      node.rows += joint.rows;
      touches_ground |= joint.from == 0 || joint.to == 0;
    }
    const bool other_reaches = b != nullptr ? b->reaches_ground : touches_ground;
    const bool self_join = b == nullptr && !touches_ground;
    node.closes_loop = list.size() > 1 || self_join || (a.reaches_ground && other_reaches);
    a.boundary.clear();
    for (int h = 0; h < static_cast<int>(draft.handles.size()); ++h) {
      Handle& handle = draft.handles[h];
      handle.kept = open_joints_[handle.body] > 0;
      if (!handle.kept) continue;
      draft.kept.push_back(h);
      a.boundary.push_back(handle.body);
    }
    a.reaches_ground |= other_reaches;
    if (b != nullptr) {
      a.ground_joints.insert(a.ground_joints.end(), b->ground_joints.begin(),
                             b->ground_joints.end());
    }
    a.node = static_cast<int>(assemblies_.size() + drafts_.size());
    drafts_.push_back(std::move(draft));
  }

  /// Renumbers the nodes depth-first, so that children are executed just before their parent.
  std::vector<Draft> DepthFirst() {
    const int leaves = static_cast<int>(assemblies_.size());
    std::vector<int> new_number(drafts_.size(), -1);
    std::vector<bool> has_parent(drafts_.size(), false);
    for (const Draft& draft : drafts_) {
      for (int child : draft.node.children) {
        if (child >= leaves) has_parent[child - leaves] = true;
      }
    }
    std::vector<Draft> ordered;
    ordered.reserve(drafts_.size());
    for (int root = 0; root < static_cast<int>(drafts_.size()); ++root) {
      if (has_parent[root]) continue;
      std::vector<std::pair<int, bool>> stack = {{root, false}};
      while (!stack.empty()) {
        auto [n, expanded] = stack.back();
        stack.pop_back();
        if (!expanded) {
          stack.push_back({n, true});
          for (int child : {drafts_[n].node.children[1], drafts_[n].node.children[0]}) {
            if (child >= leaves) stack.push_back({child - leaves, false});
          }
          continue;
        }
        for (int& child : drafts_[n].node.children) {
          if (child >= leaves) child = leaves + new_number[child - leaves];
        }
        new_number[n] = static_cast<int>(ordered.size());
        ordered.push_back(std::move(drafts_[n]));
      }
    }
    return ordered;
  }

  std::span<const PlanJoint> joints_;
  PlanOptions options_;
  std::vector<int> open_joints_;  ///< joints still to come, by body
  std::vector<Assembly> assemblies_;
  std::vector<Draft> drafts_;
};

}  // namespace

Plan::Plan(int num_bodies, std::span<const PlanJoint> joints, const PlanOptions& options)
    : num_leaves_(num_bodies - 1) {
  const std::vector<Draft> drafts = Planner(num_bodies, joints, options).Run();
  std::size_t handles = 0, kept = 0, closed = 0;
  for (const Draft& draft : drafts) {
    handles += draft.handles.size();
    kept += draft.kept.size();
    closed += draft.joints.size();
  }
  // spans stay good: the lists never grow beyond what is reserved
  handles_.reserve(handles);
  kept_.reserve(kept);
  joints_.reserve(closed);
  const auto append = [](auto& all, const auto& list) {
    const auto first = all.insert(all.end(), list.begin(), list.end());
    return std::span(first, all.end());
  };
  for (const Draft& draft : drafts) {
    PlanNode& node = nodes_.emplace_back(draft.node);
    node.handles = append(handles_, draft.handles);
    node.kept = append(kept_, draft.kept);
    node.joints = append(joints_, draft.joints);
  }
}

int Plan::depth() const {
  std::vector<int> depth(num_nodes(), 0);
  int deepest = 0;
  for (std::size_t n = 0; n < nodes_.size(); ++n) {
    for (int child : nodes_[n].children) {
      if (child >= 0) depth[num_leaves_ + n] = std::max(depth[num_leaves_ + n], depth[child] + 1);
    }
    deepest = std::max(deepest, depth[num_leaves_ + n]);
  }
  return deepest;
}

int Plan::largest_join() const {
  int rows = 0;
  for (const PlanNode& node : nodes_) rows = std::max(rows, node.rows);
  return rows;
}

int Plan::most_handles() const {
  std::size_t handles = 1;
  for (const PlanNode& node : nodes_) handles = std::max(handles, node.handles.size());
  return static_cast<int>(handles);
}

int Plan::loop_joins() const {
  return static_cast<int>(std::ranges::count_if(nodes_, &PlanNode::closes_loop));
}

}  // namespace loopbench::odca
