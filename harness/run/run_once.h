// One motion of a case: start, integration, observers, and what they write.
#pragma once

#include "harness/config/experiment.h"
#include "harness/reference/reference.h"
#include "harness/reference/series_meter.h"
#include "harness/run/merge_parts.h"
#include "harness/run/side_by_side.h"
#include "harness/trajectory/recorder.h"

namespace loopbench::harness {

/// What is known of the motion: one of them, or nothing.
struct HeldAgainst {
  const Reference* reference = nullptr;     ///< with snapshots
  const PublishedSeries* series = nullptr;  ///< with times within the horizon
};

/// `description` is that of the case or the start of a member of its ensemble, whose run has others
/// `beside` it and is watched for less; null for the run of the case itself. Parts that are
/// connected through ground alone run one after another.
Run RunOnce(const Experiment& experiment, const Case& one, const MechanismDescription& description,
            SideBySide* beside, const HeldAgainst& held = {},
            const TrajectoryTask* trajectory = nullptr);

}  // namespace loopbench::harness
