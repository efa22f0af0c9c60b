// Series of measurements over commits, and their steps.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "harness/history/change_points.h"
#include "harness/history/history.h"
#include "harness/record/measures.h"
#include "harness/tables/table.h"

namespace loopbench::harness {

// Measures over commits and their level changes.

/// Value of a commit in a series.
struct HistoryValue {
  std::size_t entry = 0;            ///< index into the history
  double value = 0.0, upper = 0.0;  ///< for times: minimum and 90th percentile
  double calibration = 0.0;         ///< for times [ns], NaN if unknown
  /// False for times measured while the machine was slower or faster than usual at that time; true
  /// if its speed is unknown. Unsteady values are not used for levels.
  bool is_steady = true;
  /// For times: common slowdown of all cases of the entry; 1 if there are few cases or none with a
  /// measurable time.
  double common = 1.0;
};

/// One measure of one case on one machine.
struct HistorySeries {
  std::string machine, one;  ///< one: the case, or kAllCases
  std::string measure, unit;
  Rule rule = Rule::kNone;
  std::vector<HistoryValue> values;
  /// at: index into `values`; levels: medians of the values. For times found after removing the
  /// common slowdown, the levels are without it too.
  std::vector<LevelChange> changes;

  std::size_t Unsteady() const;  ///< number of values at another speed of the machine
};

/// Case of the pooled series of times: median over all cases of their ratios to their own medians.
/// It shows changes that are common to all cases but too small in each.
inline constexpr const char* kAllCases = "all cases";

/// Change of the outcome or of the warnings of a case since the previous commit.
struct EndingChange {
  std::string machine, one, measure;  ///< measure: "outcome" or "warnings"
  std::size_t entry = 0;              ///< index into the history
  std::string before, after;
};

struct HistoryFindings {
  std::vector<HistorySeries> series;
  std::vector<EndingChange> endings;
  std::vector<std::string> warnings;  ///< incomplete lines of results

  std::size_t Steps() const;  ///< number of changes in series and endings
};

/// Finds all series with their changes. Times use steady values only; those of five and more cases
/// are also pooled. A change common to these cases appears only in the pooled series: a machine
/// that is slow for a week is one step. Throws std::runtime_error if a results file cannot be read.
HistoryFindings FindingsOf(const History& history);

// Steps of a history as table rows.

/// Returns a row for each step, newest first; in one commit changed outcomes come first. "ratio" is
/// empty if the level was 0 or a text.
Table StepTable(const History& history, const HistoryFindings& found);

/// Returns the number of omitted times as a sentence; nothing if there are none.
std::optional<std::string> UnsteadyNote(const HistoryFindings& found);

}  // namespace loopbench::harness
