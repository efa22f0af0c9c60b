#include "odca/plan.h"

#include <algorithm>
#include <numeric>

#include "odca/join_order.h"

namespace loopbench::odca {

namespace {

/// A PlanNode that owns its lists.
struct Draft {
  PlanNode node;
  std::vector<Handle> handles;
  std::vector<int> kept;
  std::vector<NodeJoint> joints;
};

/// An assembly while the nodes are written.
struct Assembly {
  int node = 0;
  std::vector<int> boundary;  ///< bodies with joints still to come, in order of entry
  std::vector<int> joints;    ///< to other assemblies: all that are to come, and some closed ones
  std::vector<int> ground_joints;  ///< still to come
  bool reaches_ground = false;
};

class Planner {
 public:
  Planner(int num_bodies, std::span<const PlanJoint> joints, const PlanOptions& options)
      : joints_(joints),
        options_(options),
        open_joints_(num_bodies, 0),
        closed_(joints.size(), false) {
    assemblies_.resize(num_bodies);
    assembly_of_.resize(num_bodies);
    for (int body = 1; body < num_bodies; ++body) {
      assemblies_[body].node = body - 1;
      assemblies_[body].boundary = {body};
      assembly_of_[body] = body;
    }
    for (int j = 0; j < static_cast<int>(joints.size()); ++j) {
      const int from = joints[j].from, to = joints[j].to;
      ++open_joints_[from];
      ++open_joints_[to];
      if (from == 0 || to == 0) {
        assemblies_[std::max(from, to)].ground_joints.push_back(j);
      } else {
        assemblies_[from].joints.push_back(j);
        assemblies_[to].joints.push_back(j);
      }
    }
  }

  std::vector<Draft> Run() {
    const int num_bodies = static_cast<int>(assemblies_.size());
    const std::vector<int> waiting = GroundLeaves();
    std::vector<int> number(num_bodies);  // assembly by its number in the joins
    std::iota(number.begin(), number.end(), 0);
    for (const Join& join : OrderJoins(num_bodies, joints_, waiting, options_.dim)) {
      number.push_back(Merge(number[join.left], number[join.right]));
    }
    for (Assembly& assembly : assemblies_) {
      if (!assembly.ground_joints.empty()) Ground(assembly);
    }
    return DepthFirst();
  }

 private:
  /// Returns the representative body of each body's connected part.
  std::vector<int> PartOfBody() const {
    std::vector<int> part(assemblies_.size());
    std::iota(part.begin(), part.end(), 0);
    const auto find = [&](int body) {
      while (part[body] != body) body = part[body] = part[part[body]];
      return body;
    };
    for (const PlanJoint& joint : joints_) {
      if (joint.from != 0 && joint.to != 0) part[find(joint.from)] = find(joint.to);
    }
    for (std::size_t body = 0; body < part.size(); ++body)
      part[body] = find(static_cast<int>(body));
    return part;
  }

  /// Closes joints to Ground that need not wait; the others are counted by body.
  std::vector<int> GroundLeaves() {
    const std::vector<int> part = PartOfBody();
    std::vector<int> in_part(assemblies_.size(), 0), waiting(assemblies_.size(), 0);
    for (std::size_t body = 1; body < assemblies_.size(); ++body) {
      in_part[part[body]] += static_cast<int>(assemblies_[body].ground_joints.size());
    }
    for (std::size_t body = 1; body < assemblies_.size(); ++body) {
      Assembly& assembly = assemblies_[body];
      if (options_.grounding == Grounding::kAtRoot && in_part[part[body]] <= 2) {
        waiting[body] = static_cast<int>(assembly.ground_joints.size());
      } else if (!assembly.ground_joints.empty()) {
        Ground(assembly);
      }
    }
    return waiting;
  }

  /// Joins two assemblies through all joints between them; the place of the result.
  int Merge(int left, int right) {
    // the longer list of joints stays, the shorter one is searched: each joint is visited O(log n)
    // times
    const auto size = [&](int a) { return assemblies_[a].joints.size(); };
    const int into = size(left) < size(right) ? right : left, from = into == left ? right : left;
    std::vector<int> between, leaving;
    for (int j : assemblies_[from].joints) {
      if (closed_[j]) continue;
      const bool there = Find(joints_[j].from) == into || Find(joints_[j].to) == into;
      (there ? between : leaving).push_back(j);
    }
    std::ranges::sort(between);
    for (int j : between) closed_[j] = true;
    Assembly a = std::move(assemblies_[left]), b = std::move(assemblies_[right]);
    std::vector<int> joints = std::move(into == left ? a.joints : b.joints);
    joints.insert(joints.end(), leaving.begin(), leaving.end());
    const std::size_t at_once = options_.closing == Closing::kTogether ? between.size() : 1;
    AddNode(a, &b, std::span(between).first(at_once));
    for (std::size_t k = at_once; k < between.size(); ++k) {
      AddNode(a, nullptr, std::span(between).subspan(k, 1));
    }
    a.joints = std::move(joints);
    assemblies_[into] = std::move(a);
    assemblies_[from] = {};
    assembly_of_[from] = into;
    return into;
  }

  /// Returns the index of the assembly that holds a body.
  int Find(int body) {
    while (assembly_of_[body] != body) {
      body = assembly_of_[body] = assembly_of_[assembly_of_[body]];
    }
    return body;
  }

  void Ground(Assembly& assembly) {
    const std::vector<int> list = std::move(assembly.ground_joints);
    assembly.ground_joints.clear();
    if (options_.closing == Closing::kTogether) {
      AddNode(assembly, nullptr, list);
    } else {
      for (const int& j : list) AddNode(assembly, nullptr, std::span(&j, 1));
    }
  }

  /// Appends the node that closes `list` and turns `a` into the result.
  void AddNode(Assembly& a, Assembly* b, std::span<const int> list) {
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
    a.node = static_cast<int>(assemblies_.size() - 1 + drafts_.size());
    drafts_.push_back(std::move(draft));
  }

  /// Renumbers the nodes depth-first, so that children are executed just before their parent.
  std::vector<Draft> DepthFirst() {
    const int leaves = static_cast<int>(assemblies_.size()) - 1;
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
  std::vector<int> open_joints_;      ///< joints still to come, by body
  std::vector<bool> closed_;          ///< joints between assemblies
  std::vector<int> assembly_of_;      ///< forest of merged places, see Find()
  std::vector<Assembly> assemblies_;  ///< by place: at first the body's own
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
  // spans stay valid: the lists never exceed their reserved size
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

long Plan::operations(int dim) const {
  const long d = dim;
  long sum = num_leaves_ * d * d;
  for (const PlanNode& node : nodes_) {
    const long rows = node.rows, kept = static_cast<long>(node.kept.size());
    // Z C^T: each end of a joint meets the handles of its child
    for (const NodeJoint& joint : node.joints) {
      for (int end : {joint.from, joint.to}) {
        if (end < 0) continue;
        const auto met = std::ranges::count(node.handles, node.handles[end].child, &Handle::child);
        sum += joint.rows * d * d * met;
      }
    }
    sum += 2 * d * rows * (rows + 1) / 2;             // X
    sum += rows * rows * rows / 6 + rows;             // its factor
    sum += d * rows * (rows + 1) / 2 * kept;          // V
    sum += rows * d * d * kept * (kept + 1) / 2;      // V^T V
    sum += 2 * rows * (2 * d + d * kept + rows / 2);  // vectors, up and down
  }
  return sum;
}

}  // namespace loopbench::odca
