// Measurements in the JSON that trackers of continuous benchmarking take.
#pragma once

#include <limits>
#include <string>
#include <vector>

namespace loopbench::harness {

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

}  // namespace loopbench::harness
