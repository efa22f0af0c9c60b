#include "harness/analysis/link_length.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <vector>

namespace loopbench::harness {

double LinkLength(const MechanismDescription& description) {
  std::vector<Eigen::AlignedBox3d> joints(description.bodies.size());
  double link = 0.0, arm = 0.0;
  for (const JointDescription& joint : description.joints) {
    if (joint.type == JointType::kRod) link = std::max(link, joint.parameter);
    if (joint.type == JointType::kFree) continue;
    for (const JointSide& side : {joint.from, joint.to}) {
      if (side.body == kGround) continue;
      const auto body = static_cast<std::size_t>(side.body);
      joints[body].extend(side.position);
      arm = std::max(arm, (side.position - description.bodies[body].com).norm());
    }
  }
  for (const Eigen::AlignedBox3d& extent : joints) {
    if (!extent.isEmpty()) link = std::max(link, extent.diagonal().norm());
  }
  if (link > 0.0) return link;
  return arm > 0.0 ? arm : 1.0;
}

}  // namespace loopbench::harness
