// The symbolic half of O-DCA: the order in which bodies are joined into assemblies (README.md,
// docs/decisions/004, docs/theory/order-of-joins.md).
//
// The leaves of the assembly tree are bodies, or trees of bodies on Ground. An inner node joins two
// assemblies, or one assembly with itself or with Ground, through a list of joints. It keeps as
// boundary only the bodies of joints not yet closed: one handle with all directions of the body, or
// a handle per open joint with the rows of this joint (BoundaryBasis). Ground has no handle.
//
// Properties: each body is in exactly one leaf, each joint with constraints in exactly one leaf or
// node; children come before parents; the order is depth-first, so a node's children are recent
// in memory; the plan is a function of the graph (and its numbering) alone, and takes O(n log^2 n).
// A part that floats free has its own root.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "mechanism/formulation/options.h"

namespace loopbench::odca {

/// One joint with constraints, for the planner. Body 0 is Ground.
struct PlanJoint {
  int index = 0;  ///< name of the joint for the caller
  int from = 0, to = 0;
  int rows = 0;  ///< constrained directions
  /// Its rows and the directions that it leaves free are orthogonal to each other, so that a body
  /// may be held (Leaf).
  bool may_hold = true;
};

/// When joints to Ground are closed.
enum class Grounding {
  kEager,   ///< as soon as a body is a leaf: smallest boundaries, every loop closed where it closes
  kAtRoot,  ///< last, both ends at once, as the paper's section 3.1 does for a loop to Ground; a
            ///< part with more than two joints to Ground closes them at its leaves, or the root
            ///< would grow
};

/// Numbers by which a body of a boundary is known.
enum class BoundaryBasis {
  kBodies,    ///< all directions of the body, as the paper has it
  kCheapest,  ///< those, or the rows of its open joints: by body, whichever costs less
};

struct PlanOptions {
  Grounding grounding = Grounding::kEager;
  BoundaryBasis basis = BoundaryBasis::kBodies;
  int dim = 6;            ///< directions of a body: 3 in the plane, 6 in space
  bool branches = false;  ///< several joints of a held body may hold further bodies
  long piece = 1 << 17;   ///< target size of a piece [multiply-adds]
};

/// As published, joints to Ground close at the root (the paper's section 3.1) and boundaries are
/// bodies; else joints to Ground close as early as possible, and boundaries cost least.
PlanOptions PlanOptionsOf(SolverKind solver);

/// A part of a node's boundary: a body, or the side of one of its open joints.
struct Handle {
  int body = 0;
  int joint = -1;  ///< index of the joint, -1 for the whole body
  int width = 0;   ///< rows of the joint, or directions of the body
  int child = 0;
  int place = 0;   ///< index of its first number in the boundary of the child
  int number = 0;  ///< index of its first number in both boundaries
  int slot = 0;    ///< index of its first number in all leaves
  int force = 0;   ///< of the force there: of a row, or after all rows of a direction of a body
  bool kept = false;

  bool is_body() const { return joint < 0; }
};

struct NodeJoint {
  int index = 0;
  int rows = 0;
  int from = -1, to = -1;  ///< index into the node's handles, -1 for Ground
  int row = 0;             ///< index of its first row in all nodes
};

/// A joint on a body.
struct PlanSide {
  int leaf = -1;  ///< of the body
  int joint = -1;
  int rows = 0;
  bool at_Q = false;
  int row = 0;  ///< index of its first row in all nodes
};

/// A body alone, or a tree of bodies on Ground. Its handles are the body itself, or all of its
/// sides. Bodies of a tree are held by their joints towards Ground, which are in no node. The last
/// leaf of a tree has the sides of all its bodies.
struct Leaf {
  std::span<const PlanSide> sides;
  PlanSide hold;    ///< that joint; -1 if there is none
  int holder = -1;  ///< the leaf on its other side, held too; -1 is Ground
  int end = -1;     ///< of a held leaf: the last one of its tree
  int path = 0;     ///< free directions of the joints between Ground and the body
  int column = 0;   ///< index of the first one of `hold` among all of the tree
  int free = 0;     ///< free directions of the tree
  bool is_body = true;
  int width = 0;
  int slot = 0;
  long operations = 0;
};

/// A join. Nodes 0 .. bodies-2 of a plan are leaves (body i+1 is node i) and have no PlanNode.
struct PlanNode {
  int children[2] = {-1, -1};  ///< node numbers; the second is -1 for a self-join or Ground
  int rows = 0;                ///< size of X
  /// X may lose rank: both sides reach Ground, several joints, self-join.
  bool closes_loop = false;
  int numbers = 0;       ///< of the children's boundaries
  int kept_numbers = 0;  ///< of the boundary afterwards
  int width = 0;  ///< of every handle, if all are bodies or all have as many rows, fewer; else 0
  long operations = 0;
  std::span<const Handle> handles;    ///< boundary of the children before the join, child 0 first
  std::span<const int> kept;          ///< indices into handles: the boundary afterwards, in order
  std::span<const NodeJoint> joints;  ///< closed here
};

/// Subtrees that no other piece shares: a task for one thread.
struct PlanPiece {
  std::vector<int> nodes;   ///< in order of execution
  std::vector<int> leaves;  ///< holders before the leaves that they hold
};

struct Draft;

class Plan {
 public:
  /// `num_bodies` counts Ground. Small plans are the cheapest of several by operations().
  Plan(int num_bodies, std::span<const PlanJoint> joints, const PlanOptions& options = {});
  Plan(Plan&&) = default;
  Plan& operator=(Plan&&) = default;

  int num_leaves() const { return num_leaves_; }
  int num_nodes() const { return num_leaves_ + static_cast<int>(nodes_.size()); }
  /// Inner nodes in order of execution; node number = num_leaves() + position.
  const std::vector<PlanNode>& nodes() const { return nodes_; }
  const std::vector<Leaf>& leaves() const { return leaves_; }
  /// All leaves, holders before the leaves that they hold.
  const std::vector<int>& leaf_order() const { return leaf_order_; }
  /// All nodes and leaves. The last piece contains the nodes above all other pieces. Small plans
  /// have only this piece.
  const std::vector<PlanPiece>& pieces() const { return pieces_; }
  int num_rows() const { return num_rows_; }    ///< of all nodes
  int num_slots() const { return num_slots_; }  ///< numbers of all leaves' handles

  int depth() const;         ///< longest path from a leaf to a root, in joins
  int largest_join() const;  ///< rows of the largest X
  int most_handles() const;  ///< largest number of handles of any node before its join
  int loop_joins() const;    ///< nodes that close loops
  /// Multiply-adds of one assembly and one vector pass, as Sweep::operations() counts them without
  /// regularized directions.
  long operations() const { return operations_; }

 private:
  /// With one order of joins: by the rules (`start` 0), or body after body from `start`.
  Plan(int num_bodies, std::span<const PlanJoint> joints, const PlanOptions& options, int start);
  /// Sets the holds of all leaves. Returns the other joints.
  std::vector<PlanJoint> AddHolds(std::span<const PlanJoint> joints, const PlanOptions& options);
  void AddLeaves(std::span<const PlanJoint> joints, const std::vector<bool>& is_body, int dim);
  void AddNodes(std::span<const PlanJoint> joints, std::span<const Draft> drafts, int dim);
  void CountOperations(std::span<const PlanJoint> joints, std::span<const Draft> drafts,
                       const std::vector<bool>& is_body, int dim);
  void AddPieces(long least);

  int num_leaves_;
  int num_rows_ = 0, num_slots_ = 0;
  long operations_ = 0;
  std::vector<PlanNode> nodes_;
  std::vector<Leaf> leaves_;
  std::vector<int> leaf_order_;
  std::vector<PlanPiece> pieces_;
  // the lists of all nodes, end to end in order of execution: a sweep streams them
  std::vector<Handle> handles_;
  std::vector<int> kept_;
  std::vector<NodeJoint> joints_;
  std::vector<PlanSide> sides_;
};

}  // namespace loopbench::odca
