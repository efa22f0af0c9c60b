// Times of right-hand sides and of whole simulations, in separate runs.
//
// The methods of one mechanism are measured in turn, batch by batch, so that speed changes of the
// machine affect all of them; minimum, median, 10th and 90th percentile are reported. The first
// method of each mechanism is timed a second time without a name. The difference (`aa_spread`,
// noise.h) is the smallest significant difference between methods. The calibration workload
// (calibration.h) measures the machine's speed, as the median between all rounds: `calibration_ns`
// of right-hand sides, `calibration_wall_ns` of simulations. Rounds on a slowed machine are
// measured again, for a second at most, and the quietest are kept; `discarded_repetitions` are left
// out. Right-hand sides of problems are evaluated at states of a run; families at their moving
// start.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "harness/config/experiment.h"
#include "harness/record/record.h"
#include "harness/record/select.h"

namespace loopbench::harness {

/// Cases of one mechanism, timed against each other.
struct TimingGroup {
  std::string name;  ///< of the mechanism
  /// Makes the mechanism, in the process that times it: a member of a family may be very large.
  std::function<MechanismDescription()> describe;
  std::vector<Case> cases;  ///< with keys of kind "timing" and their ids
  bool simulate = true;     ///< whole simulations too; families have right-hand sides alone
};

/// Returns an experiment's timings that pass `filter`: a group per problem (with `timing.cases` per
/// problem and horizon), then one per member of a family. The experiment must outlive them.
std::vector<TimingGroup> TimingGroups(const Experiment& experiment, const Selection& filter = {});

inline constexpr double kBatchSeconds = 1e-3;  ///< long against the clock's resolution
inline constexpr int kBatches = 15;            ///< enough for a 10th and a 90th percentile

/// One record per case, in order. A case whose simulation fails keeps its row with outcome and,
/// where it got so far, its right-hand side's time. Right-hand sides are timed in `batches`.
std::vector<Record> TimeTogether(const Experiment& experiment, const TimingGroup& group,
                                 int batches = kBatches);

/// Number of records of all groups.
std::size_t CountTimings(const Experiment& experiment, const Selection& filter = {});

}  // namespace loopbench::harness
