// Bodies that certainly cannot move: bars of a triangle on the ground, and the like.
#pragma once

#include <vector>

#include "mechanism/simplify/attach.h"

namespace loopbench {

/// Speeds of the forest above which nothing is looked for: the test is dense and runs before every
/// run.
inline constexpr int kMaxSpeedsForImmovable = 200;

/// Smallest over largest singular value of a sub-structure's constraints that counts as certain.
/// The assembled start is accurate to about 1e-13; a singular configuration would be below 1e-6.
inline constexpr double kCertain = 1e-3;

/// Returns attachments to Ground of all bodies in a rigid sub-structure at the assembled start;
/// empty if there are none, assembly fails or forces are unknown.
///
/// The rule: a set of bodies, with the joints among them and to Ground and no others, whose
/// constraints at the start have a Jacobian of full column rank, with a ratio of singular values
/// above kCertain. Such a set has no motion even to first order, so its position is isolated and
/// it stays there whatever the rest does. Joints with prescribed motions are not among these. A
/// body that merely stands still at the start, such as a slider at dead centre, is in no such set,
/// because the rest of its loop moves.
std::vector<Attachment> FindImmovable(const MechanismDescription& description);

}  // namespace loopbench
