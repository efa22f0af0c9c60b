// From the user's graph (bodies and joints, with cycles) to what is computed: a spanning forest
// rooted in Ground, and the joints left over, which become constraints.
//
// Coordinates decide the forest (docs/decisions/002):
//   joint     the forest is made of the user's joints; one joint per independent loop is cut.
//             A part that does not reach Ground hangs on a virtual free joint.
//   absolute  every body hangs on a virtual free joint from Ground, and every user joint is a
//             constraint.
// After that no algorithm asks which set is in use.
//
// Properties: every body but Ground is reached by exactly one edge, parents before children; edges
// keep the order of the user's joints as far as that allows; the result is a function of the
// description alone. Which joint of a loop is cut: rods, then joints marked "cut", then joints
// without force and initial value, then those with a force or a speed, guessed, held, and at last
// helical and driven ones; among equals the one listed last.
#pragma once

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

}  // namespace loopbench
