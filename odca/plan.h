// The symbolic half of O-DCA: the order in which bodies are joined into assemblies
// (docs/decisions/004).
//
// The assembly tree covers the graph of bodies and joints. Its leaves are the bodies. An inner node
// joins two assemblies, or one assembly with itself or with Ground, through a list of joints. It
// keeps as boundary only the bodies of joints not yet closed. Ground is an assembly with zero
// response and has no handle.
//
// Three rules build the tree; the cheapest result is used (join_order.h). A chain or ladder of n
// bodies has depth O(log n) and boundaries of one to four bodies; a k x k grid boundaries of O(k),
// hence O(n^1.5) multiply-adds. A hub takes its arms one by one, each finished before, in O(n)
// multiply-adds and a depth of as many joins as it has arms.
//
// Properties: each body is a leaf of exactly one tree, each joint with constraints is in exactly
// one node; children come before parents; the order is depth-first, so a node's children are recent
// in memory; the plan is a function of the graph (and its numbering) alone, and takes O(n log^2 n).
// A part that floats free has its own root.
#pragma once

#include <span>
#include <string>
#include <vector>

namespace loopbench::odca {

/// One joint with constraints, for the planner. Body 0 is Ground.
struct PlanJoint {
  int index = 0;  ///< name of the joint for the caller
  int from = 0, to = 0;
  int rows = 0;  ///< constrained directions
};

/// When joints to Ground are closed.
enum class Grounding {
  kEager,   ///< as soon as a body is a leaf: smallest boundaries, every loop closed where it closes
  kAtRoot,  ///< last, both ends at once, as the paper's section 3.1 does for a loop to Ground; a
            ///< part with more than two joints to Ground closes them at its leaves, or the root
            ///< would grow
};

/// Number of joints that a node may close at once.
enum class Closing {
  kTogether,  ///< all joints between two assemblies in one node (the paper's section 3.2)
  kOneByOne,  ///< the first joins, each further one is a self-join: smallest matrices
};

struct PlanOptions {
  Grounding grounding = Grounding::kEager;
  Closing closing = Closing::kTogether;
  int dim = 6;  ///< directions of a body: 3 in the plane, 6 in space; weight of join costs
};

/// A body of a node's boundary: its child (0 or 1), and its index there.
struct Handle {
  int body = 0;
  int child = 0;
  int place = 0;  ///< index into the child's kept handles
  bool kept = false;
};

struct NodeJoint {
  int index = 0;
  int rows = 0;
  int from = -1, to = -1;  ///< index into the node's handles, -1 for Ground
};

/// A join. Nodes 0 .. bodies-2 of a plan are leaves (body i+1 is node i) and have no PlanNode.
struct PlanNode {
  int children[2] = {-1, -1};  ///< node numbers; the second is -1 for a self-join or Ground
  int rows = 0;                ///< size of X
  /// X may lose rank: both sides reach Ground, several joints, self-join.
  bool closes_loop = false;
  std::span<const Handle> handles;    ///< boundary of the children before the join, child 0 first
  std::span<const int> kept;          ///< indices into handles: the boundary afterwards, in order
  std::span<const NodeJoint> joints;  ///< closed here
};

class Plan {
 public:
  /// `num_bodies` counts Ground.
  Plan(int num_bodies, std::span<const PlanJoint> joints, const PlanOptions& options = {});
  Plan(Plan&&) = default;
  Plan& operator=(Plan&&) = default;

  int num_leaves() const { return num_leaves_; }
  int num_nodes() const { return num_leaves_ + static_cast<int>(nodes_.size()); }
  /// Inner nodes in order of execution; node number = num_leaves() + position.
  const std::vector<PlanNode>& nodes() const { return nodes_; }

  int depth() const;         ///< longest path from a leaf to a root, in joins
  int largest_join() const;  ///< rows of the largest X
  int most_handles() const;  ///< largest number of bodies of any node before its join
  int loop_joins() const;    ///< nodes that close loops
  /// Multiply-adds of one assembly and one vector pass with `dim` directions per body, as
  /// Sweep::operations() counts them without regularized directions.
  long operations(int dim) const;

 private:
  int num_leaves_;
  std::vector<PlanNode> nodes_;
  // the lists of all nodes, end to end in order of execution: a sweep streams them
  std::vector<Handle> handles_;
  std::vector<int> kept_;
  std::vector<NodeJoint> joints_;
};

}  // namespace loopbench::odca
