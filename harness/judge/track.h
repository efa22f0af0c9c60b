// Tracks of measurements over commits, for trackers and for a table.
#pragma once

#include <limits>
#include <string>
#include <vector>

#include "harness/record/record.h"

namespace loopbench::harness {

// Measurements in the JSON that trackers of continuous benchmarking take.

/// One number to be tracked; smaller is better.
struct TrackedValue {
  std::string benchmark, measure, unit = {};
  double value = 0.0;
  double lower = 0.0, upper = 0.0;  ///< spread; equal to value where there is none
  double least = 0.0;               ///< of a sample, which other work on the machine disturbs least
  /// Of times [ns], NaN where not known: how fast the machine was.
  double yardstick = std::numeric_limits<double>::quiet_NaN();
};

/// github-action-benchmark, tool "customSmallerIsBetter":
///   [{"name": "<benchmark> <measure>", "unit", "value", "range": "lower .. upper"}]
/// `range` is left out without a spread. Values are finite.
std::string ToCustomSmallerIsBetter(const std::vector<TrackedValue>& values);

/// Bencher Metric Format: {benchmark: {measure: {"value", "lower_value", "upper_value"}}}. Units
/// are part of the measure's name, "cpu (ns)": the format has no place for them.
std::string ToBencherMetricFormat(const std::vector<TrackedValue>& values);

// Which numbers of a record are worth tracking over commits.

struct TrackedRecords {
  /// Counts, errors, instructions and times (median, with the 10th and 90th percentile as spread)
  /// of the records that ended well, all finite; hashes and outcomes are no numbers.
  std::vector<TrackedValue> values;
  /// What a tracker cannot take, a line each with the case and the reason: runs that failed, values
  /// that are none (demand.h), cases that are there more than once.
  std::vector<std::string> left_out;
};

TrackedRecords TrackRecords(const std::vector<Record>& records);

}  // namespace loopbench::harness
