// From the user's graph (bodies and joints, with cycles) to the computed one: a spanning forest
// rooted in Ground, and the remaining joints, which become constraints.
//
// Coordinates decide the forest (docs/decisions/002):
//   joint     the forest is made of the user's joints; one joint per independent loop is cut.
//             A part that does not reach Ground hangs on a virtual free joint.
//   absolute  every body hangs on a virtual free joint from Ground, and every user joint is a
//             constraint.
// No other algorithm depends on the coordinate set.
//
// Properties: every body except Ground is reached by exactly one edge, parents before children.
// Edges keep the order of the user's joints as far as possible. The result depends only on the
// description. Order of joints to cut: rods, joints marked "cut", joints without force and initial
// value, joints with a force or a speed, guessed, fixed, and last helical and driven ones; among
// equals the last listed.
#pragma once

#include <algorithm>
#include <numeric>
#include <string_view>
#include <vector>

#include "mechanism/description/description.h"

namespace loopbench {

enum class Coordinates { kJoint, kAbsolute };
std::string_view ToString(Coordinates coordinates);

/// One edge of the forest. `joint` indexes the description's joints, or is -1 for a virtual free
/// joint from Ground to the child's centre of mass.
struct TreeEdge {
  int joint = -1;
  int parent = kGround;
  int child = kGround;
};

struct Topology {
  std::vector<TreeEdge> edges;   ///< parents before children; one per body except Ground
  std::vector<int> constraints;  ///< joints that are not in the forest, in the user's order
};

Topology BuildTopology(const MechanismDescription& description, Coordinates coordinates);

/// Returns by joint: true if its bodies are also connected otherwise. `topology`: in joint
/// coordinates.
std::vector<bool> OnLoops(const MechanismDescription& description, const Topology& topology);

/// Sets of connected bodies; Find() gives the lowest body of a set.
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

// Connected components: the graph of bodies and joints without Ground.

/// A set of bodies that are connected with each other, paths through Ground left out.
struct Island {
  std::vector<int> bodies;  ///< ascending, without Ground
  bool grounded = false;    ///< a joint leads to Ground; otherwise the part floats
};

/// Connections that put two bodies into one island. Couplings of joints count as forces.
enum class Connection { kJoints, kJointsAndForces };

/// Returns the islands in the order of their first bodies; each body except Ground is in just one.
///
/// User-defined forces are assumed to connect all bodies.
std::vector<Island> FindIslands(const MechanismDescription& description,
                                Connection connection = Connection::kJointsAndForces);

// Parts of a description as descriptions of their own.

/// New indices of a description's parts after a selection, -1 for removed ones.
struct Renumbering {
  std::vector<int> bodies, joints;
};

/// Returns a part of a description: the bodies and joints with index >= 0 in `bodies` and `joints`,
/// and their couplings, forces, initial values and names of independent speeds. Couplings keep all
/// of their joints or are left out. `renumbering` has the new indices, in the old order.
MechanismDescription Select(const MechanismDescription& description,
                            const Renumbering& renumbering);

/// A separate island, named "whole#1", "whole#2", .. (or like the whole, if it is the only one),
/// and the indices of its bodies and joints in the whole.
struct Part {
  MechanismDescription description;
  std::vector<int> bodies, joints;
};

/// `islands` are those that FindIslands() finds, of either connection.
std::vector<Part> Split(const MechanismDescription& description,
                        const std::vector<Island>& islands);

/// Returns each set of bodies connected by joints, for analyses of geometry, which springs between
/// parts do not affect. Only forces along joints are kept, because their joints stay in the tree,
/// and ranks depend on the tree.
std::vector<Part> SplitByJoints(MechanismDescription description);

}  // namespace loopbench
