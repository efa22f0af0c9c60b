// Which numbers of a record are worth tracking over commits.
#pragma once

#include <vector>

#include "harness/record.h"
#include "harness/store/tracker_json.h"

namespace loopbench::harness {

/// Counts, errors, instructions and times (median, with the 10th and 90th percentile as spread) of
/// all records that ended well; hashes and outcomes are no numbers.
std::vector<TrackedValue> TrackedValues(const std::vector<Record>& records);

}  // namespace loopbench::harness
