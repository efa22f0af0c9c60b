// Which numbers of a record are worth tracking over commits.
#pragma once

#include <string>
#include <vector>

#include "harness/judge/tracker_json.h"
#include "harness/record/record.h"

namespace loopbench::harness {

struct TrackedRecords {
  /// Counts, errors, instructions and times (median, with the 10th and 90th percentile as spread)
  /// of the records that ended well, all finite; hashes and outcomes are no numbers.
  std::vector<TrackedValue> values;
  /// What a tracker cannot take, a line each with the case and the reason: runs that failed, values
  /// that are none (rules.h), cases that are there more than once.
  std::vector<std::string> left_out;
};

TrackedRecords TrackRecords(const std::vector<Record>& records);

}  // namespace loopbench::harness
