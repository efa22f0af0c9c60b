// Comparison of new measurements with a base, used as the gate of CI.
//
// Counts and hashes are compared exactly, errors and instructions by their ratio, times by a
// statistical test on one machine only. Incomparable values are reported with the reason, never
// counted as equal. A missing or invalid value is a difference.
#pragma once

#include <limits>
#include <string>
#include <vector>

#include "harness/judge/demand.h"
#include "harness/record/record.h"

namespace loopbench::harness {

struct CompareOptions {
  double error_ratio =
      1.05;  ///< limit for errors with equal arithmetic: equal code gives equal bits
  /// Limit for errors if the arithmetic differs: different round-off changes steps and drift.
  double error_ratio_other = 1.5;
  /// Errors below it count as equal round-off. It exceeds the largest round-off drift of the
  /// paper's problems in 100 s, 2e-12 m.
  double error_floor = 1e-11;
  double instruction_ratio = 1.02;  ///< an unchanged build shows no difference
  double time_ratio = 1.02;         ///< smaller effects are not reported
  double alpha = 0.05;              ///< probability of any false alarm among all times
  std::vector<std::string> only;    ///< groups (GroupNames()); empty: all
  bool subset = false;              ///< NEW may lack cases of BASE
  bool added = false;               ///< NEW may have cases that BASE lacks
  /// Keys by which cases of BASE and NEW are matched; all other settings may differ. Empty: all
  /// keys and the content.
  std::vector<std::string> match;
};

enum class Judgement {
  kSame,
  kBetter,
  kWorse,      ///< also a value of BASE that is missing or invalid in NEW
  kDifferent,  ///< only in NEW, or invalid in BASE: neither better nor worse
  kNotMeasured,
};
std::string_view ToString(Judgement judgement);

/// Result for one measure of one case.
struct Finding {
  std::string one = {};  ///< the case
  Measure measure = {};
  Judgement judgement = Judgement::kSame;
  std::string base = {}, fresh = {};  ///< as printed: numbers, medians, hashes
  double ratio = std::numeric_limits<double>::quiet_NaN();  ///< new / base, if meaningful
  double p = std::numeric_limits<double>::quiet_NaN();      ///< for times: p-value adjusted by Holm
  double least_p = 0.0;   ///< for times: smallest possible p-value of the sample sizes, unadjusted
  bool is_apart = false;  ///< for times: separated samples (compare.cpp)
  bool on_both = true;    ///< both sides have a value of the measure
  std::string why = {};   ///< violated rule, or reason for kNotMeasured
};

struct ComparisonReport {
  std::vector<Finding> findings;        ///< all, in the order of BASE
  std::vector<std::string> only_base;   ///< cases that NEW lacks
  std::vector<std::string> only_fresh;  ///< cases that BASE lacks
  std::vector<std::string> ambiguous;   ///< cases that occur twice on one side, not compared
  /// Cases with equal keys but different content (case_id: mechanism, limits, ensemble, ...), not
  /// compared.
  std::vector<std::string> other_content;
  /// Cases compared by options.match, with their differences (OtherSettings).
  std::vector<std::string> other_settings;

  int Count(Judgement judgement, std::string_view group = "") const;
  /// Returns the reason why the comparison is inconclusive, or "": no value or no common time was
  /// compared, or cases are missing (unless allowed by options), ambiguous or of other content.
  std::string Obstacle(const CompareOptions& options) const;
  /// Returns 1 if a value is worse or different, 2 if there is an Obstacle(), 0 if all are equal or
  /// better.
  int ExitCode(const CompareOptions& options) const;
};

ComparisonReport Compare(const std::vector<Record>& base, const std::vector<Record>& fresh,
                         const CompareOptions& options);

}  // namespace loopbench::harness
