// Bodies joined by welds move as one.
#pragma once

#include <vector>

#include "mechanism/simplify/attach.h"

namespace loopbench {

/// Attachments of welded bodies to the one of them that stands first in the description (Ground
/// before all). A weld that closes a loop in joint coordinates (topology.h) stays a joint: it is
/// where the loop is assembled and where its drift shows, and without it another joint, perhaps one
/// with an initial value, would have to be cut. A group whose welds contradict each other, or whose
/// bodies other joints connect as well, is left as it is; all are where forces are unknown.
std::vector<Attachment> FindWelded(const MechanismDescription& description);

/// Does the same with these joints alone, which must be welds; other welds count as any joint.
std::vector<Attachment> FindWelded(const MechanismDescription& description,
                                   const std::vector<bool>& welds);

}  // namespace loopbench
