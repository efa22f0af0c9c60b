// Measurements over commits, for trackers and for a table.
#pragma once

#include <limits>
#include <string>
#include <vector>

#include "harness/record/record.h"

namespace loopbench::harness {

// Measurements in JSON formats of continuous-benchmarking trackers.

/// Tracked number; smaller is better.
struct TrackedValue {
  std::string benchmark, measure, unit = {};
  double value = 0.0;
  double lower = 0.0, upper = 0.0;  ///< spread; equal to value if there is none
  double least = 0.0;  ///< minimum of a sample, least disturbed by other work on the machine
  /// Calibration time of the machine for times [ns]; NaN if unknown.
  double calibration = std::numeric_limits<double>::quiet_NaN();
};

/// github-action-benchmark, tool "customSmallerIsBetter":
///   [{"name": "<benchmark> <measure>", "unit", "value", "range": "lower .. upper"}]
/// `range` is left out without a spread. Values are finite.
std::string ToCustomSmallerIsBetter(const std::vector<TrackedValue>& values);

/// Bencher Metric Format: {benchmark: {measure: {"value", "lower_value", "upper_value"}}}. Units
/// are part of the measure's name, "cpu (ns)": the format has no place for them.
std::string ToBencherMetricFormat(const std::vector<TrackedValue>& values);

// Selection of numbers of a record to track over commits.

struct TrackedRecords {
  /// Counts, errors, instructions and times (median, with the 10th and 90th percentile as spread)
  /// of finished records, all finite; hashes and outcomes are excluded.
  std::vector<TrackedValue> values;
  /// Excluded values, one line each with case and reason: failed runs, invalid values (demand.h),
  /// repeated cases.
  std::vector<std::string> left_out;
};

TrackedRecords TrackRecords(const std::vector<Record>& records);

}  // namespace loopbench::harness
