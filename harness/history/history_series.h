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

// Measures over commits, and where they change.

/// A commit's value in a series.
struct HistoryValue {
  std::size_t entry = 0;            ///< of the history
  double value = 0.0, upper = 0.0;  ///< of times the least and the 90th percentile
  double yardstick = 0.0;           ///< of times [ns], NaN where not known
  /// Of times: the machine was as fast as it usually is about then, or it is not known how fast it
  /// was. What it did at another speed says nothing of levels.
  bool is_steady = true;
  /// Of times: by what all cases of the entry were slower than usual; 1 where there are few cases,
  /// or none that took any time.
  double common = 1.0;
};

/// One measure of one case on one machine.
struct HistorySeries {
  std::string machine, one;  ///< one: the case, or kAllCases
  std::string measure, unit;
  Rule rule = Rule::kNone;
  std::vector<HistoryValue> values;
  /// at: place in `values`; levels: medians of the values, of times without what all cases share
  /// where it is without it that they are found
  std::vector<LevelChange> changes;

  std::size_t Unsteady() const;  ///< values at another speed of the machine
};

/// The case of the series that pools times: the median over all cases of their ratios to their own
/// medians, for changes that all cases have and none shows by itself.
inline constexpr const char* kAllCases = "all cases";

/// How a case ended, or why it was doubted, where that is other than at the commit before.
struct EndingChange {
  std::string machine, one, measure;  ///< measure: "outcome" or "doubts"
  std::size_t entry = 0;              ///< of the history
  std::string before, after;
};

struct HistoryFindings {
  std::vector<HistorySeries> series;
  std::vector<EndingChange> endings;
  std::vector<std::string> warnings;  ///< torn lines of results

  std::size_t Steps() const;  ///< of both
};

/// All series with their changes, those of times among values that are steady, times of five and
/// more cases pooled too. What these cases have in common is then a matter of the pooled series
/// alone: a machine that is slower for a week is one step and not one in every case. Throws
/// std::runtime_error when a file of results cannot be read.
HistoryFindings FindingsOf(const History& history);

// The steps of a history as rows.

/// A row for each step, newest first; of one commit other endings first. "ratio" is empty where the
/// level was 0 or is a text.
Table StepTable(const History& history, const HistoryFindings& found);

/// How many times were left out; nothing where none was.
std::optional<std::string> UnsteadyNote(const HistoryFindings& found);

}  // namespace loopbench::harness
