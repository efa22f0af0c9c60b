// Time of right-hand sides and of whole simulations, in runs of their own.
//
// The columns of one mechanism are measured in turn, batch by batch, so that a change of the
// machine's speed hits all of them; minimum, median, 10th and 90th percentile are reported. The
// first column of each mechanism is timed a second time under no name: how far it is from itself
// (`aa_spread`, noise.h) is the least difference between columns that means anything.
// Right-hand sides of scenes are evaluated at states from an actual run, those of families at their
// moving start.
#pragma once

#include <functional>
#include <vector>

#include "harness/config/experiment.h"
#include "harness/record.h"

namespace loopbench::harness {

/// Times all timing cases of the experiment, scene by scene, then its families. One record per case
/// (kind "timing"); a case whose simulation fails keeps its row with outcome and, where it got so
/// far, its right-hand side's time. `done` is called after each case's record is complete.
std::vector<Record> TimeExperiment(const Experiment& experiment,
                                   const std::function<void(const Record&)>& done);

/// Number of records that TimeExperiment() will make.
std::size_t CountTimings(const Experiment& experiment);

}  // namespace loopbench::harness
