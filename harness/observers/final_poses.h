// Where a run ended: the poses of the user's bodies, whatever was simplified for it.
#pragma once

#include "harness/record/record.h"
#include "mechanism/simplify/compile.h"

namespace loopbench::harness {

/// Writes "series.final.<body>" for the bodies of `part`, at most kMostFinalBodies of the whole
/// mechanism, evenly chosen: of a planar mechanism x, y [m] of the body's origin and its angle
/// [rad] with all its turns; in space x, y, z and the body's first two axes in ground axes, where
/// whole turns do not show.
inline constexpr std::size_t kMostFinalBodies = 100;
template <class Space>
void WriteFinalPoses(const MechanismDescription& user, const Compiled& compiled, int part,
                     const Kinematics<Space, double>& kinematics, Record& record);

}  // namespace loopbench::harness
