#include "odca/plan.h"

#include <algorithm>
#include <array>
#include <numeric>

#include "odca/join_order.h"

namespace loopbench::odca {

/// A body of a boundary, before and after a join.
struct BoundaryBody {
  int body = 0;
  int child = 0;
  int rows = 0;       ///< of its open joints
  int open_rows = 0;  ///< of those that stay open
};

/// A PlanNode whose boundary is bodies.
struct Draft {
  PlanNode node;
  std::vector<BoundaryBody> bodies;
  std::vector<int> joints;  ///< positions in the list of joints
};

namespace {

/// An assembly while the nodes are written.
struct Assembly {
  int node = 0;
  std::vector<int> boundary;  ///< bodies with joints still to come, in order of entry
  std::vector<int> joints;    ///< to other assemblies: all that are to come, and some closed ones
  /// To Ground, or between two bodies of a tree; still to come.
  std::vector<int> leaf_joints;
  bool reaches_ground = false;
};

class Planner {
 public:
  Planner(std::span<const Leaf> leaves, std::span<const PlanJoint> joints,
          const PlanOptions& options)
      : joints_(joints),
        options_(options),
        open_rows_(leaves.size() + 1, 0),
        closed_(joints.size(), false) {
    const auto num_bodies = static_cast<int>(open_rows_.size());
    assemblies_.resize(num_bodies);
    assembly_of_.assign(num_bodies, 0);
    for (int body = 1; body < num_bodies; ++body) {
      const Leaf& leaf = leaves[body - 1];
      assembly_of_[body] = leaf.end < 0 ? body : leaf.end + 1;
      assemblies_[body].node = body - 1;
      assemblies_[body].reaches_ground = leaf.end >= 0;
      assemblies_[assembly_of_[body]].boundary.push_back(body);
    }
    for (int j = 0; j < static_cast<int>(joints.size()); ++j) {
      PlanJoint between = joints[j];
      open_rows_[between.from] += between.rows;
      open_rows_[between.to] += between.rows;
      between.from = assembly_of_[between.from];
      between.to = assembly_of_[between.to];
      if (between.from == 0 || between.to == 0 || between.from == between.to) {
        assemblies_[std::max(between.from, between.to)].leaf_joints.push_back(j);
      } else {
        assemblies_[between.from].joints.push_back(j);
        assemblies_[between.to].joints.push_back(j);
      }
      if (between.from != between.to) between_leaves_.push_back(between);
    }
  }

  std::vector<Draft> Run(int start) {
    const int num_bodies = static_cast<int>(assemblies_.size());
    const std::vector<int> waiting = CloseLeaves();
    std::vector<int> number(num_bodies);  // assembly by its number in the joins
    std::iota(number.begin(), number.end(), 0);
    for (const Join& join : OrderJoins(num_bodies, between_leaves_, waiting, options_.dim, start)) {
      number.push_back(Merge(number[join.left], number[join.right]));
    }
    for (Assembly& assembly : assemblies_) {
      if (!assembly.leaf_joints.empty()) CloseLeafJoints(assembly);
    }
    return DepthFirst();
  }

 private:
  /// Closes the joints of leaves. Returns by body the number of joints that must wait.
  std::vector<int> CloseLeaves() {
    std::vector<int> part(assemblies_.size());  // forest of connected bodies, see RootOf()
    std::iota(part.begin(), part.end(), 0);
    for (const PlanJoint& joint : between_leaves_) {
      if (joint.from == 0 || joint.to == 0) continue;
      part[RootOf(joint.from, part)] = RootOf(joint.to, part);
    }
    std::vector<int> in_part(assemblies_.size(), 0), waiting(assemblies_.size(), 0);
    const int num_bodies = static_cast<int>(assemblies_.size());
    for (int body = 1; body < num_bodies; ++body) {
      in_part[RootOf(body, part)] += static_cast<int>(assemblies_[body].leaf_joints.size());
    }
    for (int body = 1; body < num_bodies; ++body) {
      Assembly& assembly = assemblies_[body];
      if (options_.grounding == Grounding::kAtRoot && in_part[RootOf(body, part)] <= 2) {
        waiting[body] = static_cast<int>(assembly.leaf_joints.size());
      } else if (!assembly.leaf_joints.empty()) {
        CloseLeafJoints(assembly);
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
      const bool there = RootOf(joints_[j].from, assembly_of_) == into ||
                         RootOf(joints_[j].to, assembly_of_) == into;
      (there ? between : leaving).push_back(j);
    }
    std::ranges::sort(between);
    for (int j : between) closed_[j] = true;
    Assembly a = std::move(assemblies_[left]), b = std::move(assemblies_[right]);
    std::vector<int> joints = std::move(into == left ? a.joints : b.joints);
    joints.insert(joints.end(), leaving.begin(), leaving.end());
    AddNode(a, &b, between);
    a.joints = std::move(joints);
    assemblies_[into] = std::move(a);
    assemblies_[from] = {};
    assembly_of_[from] = into;
    return into;
  }

  /// Returns the root of the tree that holds `i`, and shortens the way there.
  static int RootOf(int i, std::vector<int>& forest) {
    while (forest[i] != i) i = forest[i] = forest[forest[i]];
    return i;
  }

  void CloseLeafJoints(Assembly& assembly) {
    const std::vector<int> list = std::move(assembly.leaf_joints);
    assembly.leaf_joints.clear();
    AddNode(assembly, nullptr, list);
  }

  /// Appends the node that closes `list` and turns `a` into the result.
  void AddNode(Assembly& a, Assembly* b, std::span<const int> list) {
    Draft draft;
    PlanNode& node = draft.node;
    node.children[0] = a.node;
    node.children[1] = b != nullptr ? b->node : -1;
    for (int child = 0; child < (b != nullptr ? 2 : 1); ++child) {
      for (int body : child == 0 ? a.boundary : b->boundary) {
        draft.bodies.push_back({body, child, open_rows_[body], 0});
      }
    }
    bool touches_ground = false;
    for (int j : list) {
      const PlanJoint& joint = joints_[j];
      open_rows_[joint.from] -= joint.rows;
      open_rows_[joint.to] -= joint.rows;
      draft.joints.push_back(j);
      node.rows += joint.rows;
      touches_ground |= joint.from == 0 || joint.to == 0;
    }
    const bool other_reaches = b != nullptr ? b->reaches_ground : touches_ground;
    const bool self_join = b == nullptr && !touches_ground;
    node.closes_loop = list.size() > 1 || self_join || (a.reaches_ground && other_reaches);
    a.boundary.clear();
    for (BoundaryBody& body : draft.bodies) {
      body.open_rows = open_rows_[body.body];
      if (body.open_rows > 0) a.boundary.push_back(body.body);
    }
    a.reaches_ground |= other_reaches;
    if (b != nullptr) {
      a.leaf_joints.insert(a.leaf_joints.end(), b->leaf_joints.begin(), b->leaf_joints.end());
    }
    a.node = static_cast<int>(assemblies_.size() - 1 + drafts_.size());
    drafts_.push_back(std::move(draft));
  }

  /// Renumbers the nodes depth-first, so that children are executed just before their parent.
  std::vector<Draft> DepthFirst() {
    const int leaves = static_cast<int>(assemblies_.size()) - 1;
    std::vector<bool> is_root(drafts_.size(), true);
    for (const Draft& draft : drafts_) {
      for (int child : draft.node.children) {
        if (child >= leaves) is_root[child - leaves] = false;
      }
    }
    std::vector<int> waiting, order;  // the order from its end: parents first
    for (int n = 0; n < static_cast<int>(drafts_.size()); ++n) {
      if (is_root[n]) waiting.push_back(n);
    }
    while (!waiting.empty()) {
      order.push_back(waiting.back());
      waiting.pop_back();
      for (int child : drafts_[order.back()].node.children) {
        if (child >= leaves) waiting.push_back(child - leaves);
      }
    }
    std::vector<int> new_number(drafts_.size(), -1);
    std::vector<Draft> ordered;
    ordered.reserve(drafts_.size());
    for (auto n = order.rbegin(); n != order.rend(); ++n) {
      for (int& child : drafts_[*n].node.children) {
        if (child >= leaves) child = leaves + new_number[child - leaves];
      }
      new_number[*n] = static_cast<int>(ordered.size());
      ordered.push_back(std::move(drafts_[*n]));
    }
    return ordered;
  }

  std::span<const PlanJoint> joints_;
  std::vector<PlanJoint> between_leaves_;  ///< its `from` and `to` are the last bodies of trees
  PlanOptions options_;
  std::vector<int> open_rows_;        ///< rows of joints still to come, by body
  std::vector<bool> closed_;          ///< joints between assemblies
  std::vector<int> assembly_of_;      ///< forest of merged places, see RootOf()
  std::vector<Assembly> assemblies_;  ///< by place: at first the body's own
  std::vector<Draft> drafts_;
};

/// Multiply-adds of a join of `rows` rows that keeps so many numbers, without JointWork().
long JoinWork(long rows, long kept) {
  long sum = rows * rows * rows / 6 + rows;   // factor of X
  sum += rows * (rows + 1) / 2 * kept;        // V
  sum += rows * (kept * (kept + 1) / 2);      // V^T V
  return sum + 2 * rows * (kept + rows / 2);  // vectors, up and down
}

/// Multiply-adds of a joint of a join on one of its bodies, whose child has so many numbers (0 for
/// a leaf): Y and X, and the vectors. `above`: rows of the join before this joint's.
long JointWork(long rows, long above, bool is_body, long numbers, long dim) {
  const long force = rows * dim;
  if (!is_body) return force;
  return 2 * force + rows * dim * numbers + dim * (rows * above + rows * (rows + 1) / 2);
}

/// Multiply-adds of a leaf with so many rows of joints: M^-1 C^T and C M^-1 C^T, and the vectors.
/// `paths`: sum of the rows times the free directions on the path to their body.
long LeafWork(const Leaf& leaf, long rows, long paths, bool is_body, long dim) {
  const long apply = dim * dim / 3;  // M^-1 is diagonal except for three rotations
  const long triangle = rows * (rows + 1) / 2, project = is_body ? 0 : rows * dim;
  if (leaf.end < 0) return (rows + 1) * apply + (is_body ? 0 : dim * triangle) + project;
  const long path = leaf.path, free = leaf.free, held = leaf.hold.rows;
  long sum = path * apply + dim * (path * (path + 1) / 2 + path - (dim - held));  // H^T M H
  sum += rows > 0 ? free * free * free / 6 + free : 0;
  sum += paths * dim + (is_body ? rows * free * dim : free * triangle);  // Z
  return sum + 2 * dim * (held + 2 * path) + apply + project + (is_body ? 0 : free * rows);
}

/// Multiply-adds of a join whose bodies are known by all their directions, or by rows of joints.
long DraftWork(const Draft& draft, std::span<const PlanJoint> joints,
               const std::vector<bool>& is_body, int dim) {
  const auto width = [&](int body, long open) { return open > 0 && is_body[body] ? dim : open; };
  long numbers[2] = {0, 0}, kept = 0, above = 0;
  for (const BoundaryBody& body : draft.bodies) {
    numbers[body.child] += width(body.body, body.rows);
    kept += width(body.body, body.open_rows);
  }
  long sum = JoinWork(draft.node.rows, kept);
  for (int j : draft.joints) {
    for (int body : {joints[j].from, joints[j].to}) {
      if (body == 0) continue;
      const int child = std::ranges::find(draft.bodies, body, &BoundaryBody::body)->child;
      const bool is_leaf = draft.node.children[child] + 1 < static_cast<int>(is_body.size());
      sum += JointWork(joints[j].rows, above, is_body[body], is_leaf ? 0 : numbers[child], dim);
    }
    above += joints[j].rows;
  }
  return sum;
}

/// Chooses for each body between its directions and the rows of its joints: whichever costs less
/// over all joins with this body, given the choice of the others. Trees have the rows of their
/// joints, unless all of these are on the last body.
std::vector<bool> CheapestBases(std::span<const Leaf> leaves, std::span<const PlanJoint> joints,
                                std::span<const Draft> drafts, int dim) {
  const auto num_leaves = static_cast<int>(leaves.size()), num_bodies = num_leaves + 1;
  std::vector<long> rows(num_bodies, 0);
  for (const PlanJoint& joint : joints) {
    for (int body : {joint.from, joint.to}) rows[body] += joint.rows;
  }
  std::vector<bool> is_body(num_bodies), has_choice(num_bodies, true);
  for (int body = 1; body < num_bodies; ++body) {
    const int end = leaves[body - 1].end;
    if (end < 0 || end == body - 1 || rows[body] == 0) continue;
    has_choice[body] = has_choice[end + 1] = false;
  }
  for (int body = 1; body < num_bodies; ++body) {
    is_body[body] = has_choice[body] && rows[body] > 2 * dim;
  }
  std::vector<std::vector<int>> joins(num_bodies);
  for (int n = 0; n < static_cast<int>(drafts.size()); ++n) {
    for (const BoundaryBody& body : drafts[n].bodies) joins[body.body].push_back(n);
  }
  for (int body = 1; body < num_bodies; ++body) {
    if (!has_choice[body]) continue;
    const Leaf& leaf = leaves[body - 1];
    long sums[2];
    for (int choice : {0, 1}) {
      is_body[body] = choice == 1;
      sums[choice] = LeafWork(leaf, rows[body], rows[body] * leaf.path, is_body[body], dim);
      for (int n : joins[body]) sums[choice] += DraftWork(drafts[n], joints, is_body, dim);
    }
    is_body[body] = sums[1] < sums[0];
  }
  return is_body;
}

/// Up to so many bodies all fronts are tried: a chain of them is not cut in two, and is deep.
constexpr int kFewBodies = 16;

/// More pieces leave more nodes to one thread. Fewer pieces balance threads less well.
constexpr int kMostPieces = 64;

}  // namespace

PlanOptions PlanOptionsOf(SolverKind solver) {
  if (solver == SolverKind::kAsPublished) return {.grounding = Grounding::kAtRoot};
  return {.grounding = Grounding::kEager, .basis = BoundaryBasis::kCheapest};
}

Plan::Plan(int num_bodies, std::span<const PlanJoint> joints, const PlanOptions& options)
    : Plan(num_bodies, joints, options, 0) {
  if (options.basis != BoundaryBasis::kCheapest || num_leaves_ > kFewBodies) return;
  PlanOptions each = options;
  for (const bool branches : {false, true}) {
    each.branches = branches;
    for (int start = branches ? 0 : 1; start < num_bodies; ++start) {
      Plan other(num_bodies, joints, each, start);
      if (other.operations() < operations()) *this = std::move(other);
    }
  }
}

Plan::Plan(int num_bodies, std::span<const PlanJoint> joints, const PlanOptions& options, int start)
    : num_leaves_(num_bodies - 1) {
  const std::vector<PlanJoint> others = AddHolds(joints, options);
  std::vector<Draft> drafts = Planner(leaves_, others, options).Run(start);
  std::vector<bool> is_body(num_bodies, true);
  if (options.basis == BoundaryBasis::kCheapest) {
    is_body = CheapestBases(leaves_, others, drafts, options.dim);
  }
  AddLeaves(others, is_body, options.dim);
  AddNodes(others, drafts, options.dim);
  CountOperations(others, drafts, is_body, options.dim);
  AddPieces(options.piece);
}

/// A body with one joint to Ground is the first one of a tree. The other joints of a held body hold
/// further bodies, if there is one such joint or trees may branch. All trees grow in turn. In rings
/// and in the included mechanisms, paths of up to d - 2 free directions need the fewest operations,
/// within 1 %.
std::vector<PlanJoint> Plan::AddHolds(std::span<const PlanJoint> joints,
                                      const PlanOptions& options) {
  leaves_.resize(static_cast<std::size_t>(num_leaves_));
  std::vector<std::vector<int>> joints_of(num_leaves_ + 1);
  for (int j = 0; j < static_cast<int>(joints.size()); ++j) {
    for (const int body : {joints[j].from, joints[j].to}) joints_of[body].push_back(j);
  }
  std::vector<bool> holds(joints.size(), false);
  std::vector<int> held;                   // leaves, holders first
  std::vector<int> root(num_leaves_, -1);  // of each held leaf
  std::vector<Leaf> whole(leaves_);        // of each tree, by root: `free` and `end`
  const auto other = [&](int j, int body) {
    return joints[j].from == body ? joints[j].to : joints[j].from;
  };
  const auto hold = [&](int n, int j) {
    const PlanJoint& joint = joints[j];
    const int holder = other(j, n + 1) - 1, own = options.dim - joint.rows;
    const int first = holder < 0 ? n : root[holder];
    const int path = own + (holder < 0 ? 0 : leaves_[holder].path);
    if (root[n] >= 0 || !joint.may_hold || 2 * joint.rows <= options.dim) return;
    if (path > options.dim - 2 || own + whole[first].free > options.dim) return;
    leaves_[n].hold = {n, joint.index, joint.rows, joint.to == n + 1};
    leaves_[n].holder = holder;
    leaves_[n].path = path;
    root[n] = first;
    whole[first].free += own;
    whole[first].end = n;
    // columns of the last bodies come first, so that the factor of N has its zeros
    leaves_[n].column = -whole[first].free;
    holds[j] = true;
    held.push_back(n);
  };
  if (options.basis == BoundaryBasis::kCheapest && options.grounding == Grounding::kEager) {
    for (int n = 0; n < num_leaves_; ++n) {
      const auto on_ground = [&](int j) { return other(j, n + 1) == 0; };
      const std::vector<int>& all = joints_of[n + 1];
      if (std::ranges::count_if(all, on_ground) == 1)
        hold(n, *std::ranges::find_if(all, on_ground));
    }
    for (std::size_t k = 0; k < held.size(); ++k) {
      const int body = held[k] + 1;
      if (joints_of[body].size() != 2 && !options.branches) continue;
      for (const int j : joints_of[body]) {
        if (!holds[j] && other(j, body) != 0) hold(other(j, body) - 1, j);
      }
    }
  }
  for (int n = 0; n < num_leaves_; ++n) {
    if (leaves_[n].holder < 0) leaf_order_.push_back(n);
  }
  for (const int n : held) {
    Leaf& leaf = leaves_[n];
    if (leaf.holder >= 0) leaf_order_.push_back(n);
    leaf.end = whole[root[n]].end;
    leaf.free = whole[root[n]].free;
    leaf.column += leaf.free;
  }
  std::vector<PlanJoint> others;
  for (std::size_t j = 0; j < joints.size(); ++j) {
    if (!holds[j]) others.push_back(joints[j]);
  }
  return others;
}

void Plan::AddLeaves(std::span<const PlanJoint> joints, const std::vector<bool>& is_body, int dim) {
  const auto each_side = [&](auto&& take) {
    for (int j = 0; j < static_cast<int>(joints.size()); ++j) {
      for (const bool at_Q : {false, true}) {
        const int leaf = (at_Q ? joints[j].to : joints[j].from) - 1;
        if (leaf < 0) continue;
        const int end = leaves_[leaf].end;
        take(end < 0 ? leaf : end, PlanSide{leaf, j, joints[j].rows, at_Q});
      }
    }
  };
  std::vector<int> first(num_leaves_ + 1, 0);
  each_side([&](int leaf, const PlanSide&) { ++first[leaf + 1]; });
  std::partial_sum(first.begin(), first.end(), first.begin());
  sides_.resize(static_cast<std::size_t>(first.back()));
  std::vector<int> next = first;
  each_side([&](int leaf, const PlanSide& side) { sides_[next[leaf]++] = side; });
  for (int n = 0; n < num_leaves_; ++n) {
    Leaf& leaf = leaves_[n];
    leaf.sides = std::span(sides_).subspan(first[n], first[n + 1] - first[n]);
    leaf.is_body = is_body[n + 1];
    leaf.slot = num_slots_;
    if (leaf.is_body) leaf.width = dim;
    if (!leaf.is_body) {
      for (const PlanSide& side : leaf.sides) leaf.width += side.rows;
    }
    num_slots_ += leaf.width;
  }
}

/// Writes the lists of all nodes, with the handles of bodies or of their open joints.
void Plan::AddNodes(std::span<const PlanJoint> joints, std::span<const Draft> drafts, int dim) {
  std::vector<std::vector<Handle>> boundary(leaves_.size() + drafts.size());
  for (int n = 0; n < num_leaves_; ++n) {
    const Leaf& leaf = leaves_[n];
    Handle handle{.body = n + 1, .width = leaf.width, .slot = leaf.slot};
    if (leaf.is_body) boundary[n].push_back(handle);
    for (const PlanSide& side : leaf.is_body ? std::span<const PlanSide>() : leaf.sides) {
      handle.body = side.leaf + 1;
      handle.joint = side.joint;
      handle.width = side.rows;
      boundary[n].push_back(handle);
      handle.slot += side.rows;
    }
  }
  std::vector<int> row_of(joints.size(), 0);
  std::vector<std::array<std::size_t, 3>> first;  // handle, kept one and joint of each node
  for (const Draft& draft : drafts) {
    PlanNode& node = nodes_.emplace_back(draft.node);
    first.push_back({handles_.size(), kept_.size(), joints_.size()});
    for (int child = 0; child < 2; ++child) {
      if (node.children[child] < 0) continue;
      int place = 0;
      for (Handle handle : boundary[node.children[child]]) {
        handle.child = child;
        handle.place = place;
        handle.number = node.numbers;
        place += handle.width;
        node.numbers += handle.width;
        handles_.push_back(handle);
      }
      boundary[node.children[child]] = {};
    }
    const std::span handles = std::span(handles_).subspan(first.back()[0]);
    const int width = handles[0].width;
    const auto alike = [&](const Handle& handle) {
      return handle.width == width && handle.is_body() == (width == dim);
    };
    if (std::ranges::all_of(handles, alike)) node.width = width;
    for (int j : draft.joints) {
      row_of[j] = num_rows_;
      const auto handle_at = [&](int body) {
        const auto at = std::ranges::find_if(handles, [&](const Handle& handle) {
          return handle.body == body && (handle.is_body() || handle.joint == j);
        });
        return body == 0 ? -1 : static_cast<int>(at - handles.begin());
      };
      joints_.push_back({joints[j].index, joints[j].rows, handle_at(joints[j].from),
                         handle_at(joints[j].to), num_rows_});
      num_rows_ += joints[j].rows;
    }
    const auto stays = [&](const Handle& handle) {
      return handle.is_body()
                 ? std::ranges::find(draft.bodies, handle.body, &BoundaryBody::body)->open_rows > 0
                 : std::ranges::find(draft.joints, handle.joint) == draft.joints.end();
    };
    for (int h = 0; h < static_cast<int>(handles.size()); ++h) {
      handles[h].kept = stays(handles[h]);
      if (!handles[h].kept) continue;
      kept_.push_back(h);
      node.kept_numbers += handles[h].width;
      boundary[num_leaves_ + nodes_.size() - 1].push_back(handles[h]);
    }
  }
  for (Handle& handle : handles_) {
    const int j = handle.joint;
    handle.force = handle.is_body() ? num_rows_ + handle.width * (handle.body - 1) : row_of[j];
    if (!handle.is_body()) handle.joint = joints[j].index;
  }
  for (PlanSide& side : sides_) {
    side.row = row_of[side.joint];
    side.joint = joints[side.joint].index;
  }
  first.push_back({handles_.size(), kept_.size(), joints_.size()});
  for (std::size_t n = 0; n < nodes_.size(); ++n) {
    const auto part = [&](auto& all, int list) {
      return std::span(all).subspan(first[n][list], first[n + 1][list] - first[n][list]);
    };
    nodes_[n].handles = part(handles_, 0);
    nodes_[n].kept = part(kept_, 1);
    nodes_[n].joints = part(joints_, 2);
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

void Plan::CountOperations(std::span<const PlanJoint> joints, std::span<const Draft> drafts,
                           const std::vector<bool>& is_body, int dim) {
  for (Leaf& leaf : leaves_) {
    long rows = 0, paths = 0;
    for (const PlanSide& side : leaf.sides) {
      rows += side.rows;
      paths += side.rows * leaves_[side.leaf].path;
    }
    leaf.operations = LeafWork(leaf, rows, paths, leaf.is_body, dim);
    operations_ += leaf.operations;
  }
  for (std::size_t n = 0; n < drafts.size(); ++n) {
    nodes_[n].operations = DraftWork(drafts[n], joints, is_body, dim);
    operations_ += nodes_[n].operations;
  }
}

/// A piece takes neighbouring subtrees of up to `share` operations each, until it has share / 2.
/// Pieces do not depend on the number of threads.
void Plan::AddPieces(long least) {
  const long share = std::max(least, operations_ / kMostPieces);
  const bool divides = operations_ >= 2 * share;
  std::vector<long> sum(num_nodes(), 0);  // of subtrees
  std::vector<int> parent(num_nodes(), -1), piece(num_nodes(), -1);
  const auto last = [&](int leaf) { return leaves_[leaf].end < 0 ? leaf : leaves_[leaf].end; };
  for (const int leaf : leaf_order_) sum[last(leaf)] += leaves_[leaf].operations;
  for (int n = num_leaves_; n < num_nodes(); ++n) {
    sum[n] = nodes_[n - num_leaves_].operations;
    for (const int child : nodes_[n - num_leaves_].children) {
      if (child < 0) continue;
      sum[n] += sum[child];
      parent[child] = n;
    }
  }
  const auto is_whole = [&](int n) { return divides && sum[n] <= share; };
  long filled = share;
  const auto place = [&](int n) {
    if (!is_whole(n)) return;
    if (2 * filled >= share) {
      pieces_.emplace_back();
      filled = 0;
    }
    piece[n] = static_cast<int>(pieces_.size()) - 1;
    if (parent[n] < 0 || !is_whole(parent[n])) filled += sum[n];
  };
  for (int n = num_leaves_; n < num_nodes(); ++n) place(n);
  for (const int leaf : leaf_order_) {
    if (leaf == last(leaf) && parent[leaf] < 0) place(leaf);
  }
  pieces_.emplace_back();
  const auto of = [&](int n) -> PlanPiece& {
    return piece[n] < 0 ? pieces_.back() : pieces_[piece[n]];
  };
  for (int n = num_leaves_; n < num_nodes(); ++n) of(n).nodes.push_back(n);
  for (const int leaf : leaf_order_) {
    const int end = last(leaf);
    of(parent[end] < 0 ? end : parent[end]).leaves.push_back(leaf);
  }
}

}  // namespace loopbench::odca
