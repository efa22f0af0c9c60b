// Targets of poses and points (InitialDescription::poses) as initial coordinates.
//
// A target is a free joint from Ground that closes a loop without constraints: its coordinates are
// the pose of the body in the target's frame. Given ones count as fixed values or as guesses of 0
// in the assembly (closure.h), which thus meets fixed targets exactly. It minimises the weighted
// sum of squares of the distances from the others.
#pragma once

#include <string>
#include <vector>

#include "mechanism/start/assembly.h"

namespace loopbench {

/// The description with its targets as joints, behind its own.
MechanismDescription WithTargets(const MechanismDescription& description);

/// Assembles the description with its targets and takes over the coordinates of the result as
/// initial ones. Returns "", or the reason why fixed targets and loops cannot be satisfied.
std::string ResolvePoses(MechanismDescription* description);

/// Distance of a body from a target.
struct MissedPose {
  const PoseTarget* target = nullptr;
  double shift = 0.0, turn = 0.0;  ///< [m], [rad]; 0 if not given
};

/// Targets missed by positions q, which are joint coordinates in the order of the description, by
/// more than a hundredth of a link or of a radian.
std::vector<MissedPose> FindMissedPoses(const MechanismDescription& description,
                                        const VectorX<double>& q);

}  // namespace loopbench
