// The precision ladders of an experiment (harness/precision/ladder.h): one per scene and column.
#pragma once

#include <vector>

#include "harness/precision/ladder.h"
#include "harness/record/record.h"

namespace loopbench::harness {

/// A ladder and the keys of its records: those of the reference, then of every rung in the order of
/// Ladder::rungs (kind "precision", with case_id and content).
struct LadderGroup {
  LadderTask task;  ///< without the description, which is made in the process that climbs
  std::size_t scene = 0;
  std::vector<Record> keys;
};

/// Groups without a rung that passes the filter are left out.
std::vector<LadderGroup> LadderGroups(const Experiment& experiment, const Selection& filter = {});

/// Number of records of all groups.
std::size_t CountRungs(const Experiment& experiment);

/// Throws ConfigError for a scene that the ladder cannot run: one that is not planar once it is
/// compiled, or with tables of time. Scenes are compiled in a child process, under the experiment's
/// limits; one that they cut off is not refused here.
void CheckLadders(const Experiment& experiment);

/// Throws ConfigError when the experiment has ladders and this program cannot run them: as above,
/// or when it was built without their scalars (LOOPBENCH_PRECISIONS).
void RequireLadders(const Experiment& experiment);

/// One record per key, in order.
std::vector<Record> ClimbTogether(const Experiment& experiment, const LadderGroup& group);

}  // namespace loopbench::harness
