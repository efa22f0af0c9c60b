// Whether new measurements are as good as those of a base: the gate of CI, and of anyone who
// changes code.
//
// Counts and hashes are held against each other exactly, errors and instructions by their ratio,
// times by a test, and never those of two machines. What could not be compared is said, with the
// reason, and is never taken for "the same": a value that one side lacks, or that is not what its
// measure is made of, is a difference.
#pragma once

#include <limits>
#include <string>
#include <vector>

#include "harness/judge/demand.h"
#include "harness/record/record.h"

namespace loopbench::harness {

struct CompareOptions {
  double error_ratio = 1.05;  ///< of errors, under one arithmetic: equal code gives equal bits
  /// The same if the arithmetic differs. Different round-off moves steps, and drift with them.
  double error_ratio_other = 1.5;
  /// Errors below it are round-off and equal: above the largest round-off drift of 100 s of the
  /// paper's scenes, 2e-12 m.
  double error_floor = 1e-11;
  double instruction_ratio = 1.02;  ///< far above what an unchanged build shows, which is nothing
  double time_ratio = 1.02;         ///< smaller effects are not worth a message
  double alpha = 0.05;              ///< probability of any false alarm among all times
  std::vector<std::string> only;    ///< groups (GroupNames()); empty: all
  bool subset = false;              ///< NEW may lack cases of BASE
  bool added = false;               ///< NEW may have cases that BASE lacks
  /// Keys by which cases of BASE and NEW meet; all other settings may differ. Empty: by all keys
  /// and the content.
  std::vector<std::string> match;
};

enum class Judgement {
  kSame,
  kBetter,
  kWorse,      ///< also what BASE has and NEW has lost or holds as no value of the measure
  kDifferent,  ///< only in NEW, or no value of the measure in BASE: neither better nor worse
  kNotMeasured,
};
std::string_view ToString(Judgement judgement);

/// One measure of one case.
struct Finding {
  std::string one = {};  ///< the case
  Measure measure = {};
  Judgement judgement = Judgement::kSame;
  std::string base = {}, fresh = {};  ///< as printed: numbers, medians, hashes
  double ratio = std::numeric_limits<double>::quiet_NaN();  ///< new / base, where it says anything
  double p = std::numeric_limits<double>::quiet_NaN();      ///< of times: adjusted by Holm
  double least_p = 0.0;   ///< of times: the least that samples of their sizes can give, unadjusted
  bool is_apart = false;  ///< of times: the samples are too far apart for any chance (compare.cpp)
  bool on_both = true;    ///< both sides have a value of the measure
  std::string why = {};   ///< the rule it broke, or the reason why it was not measured
};

struct ComparisonReport {
  std::vector<Finding> findings;        ///< all, in the order of BASE
  std::vector<std::string> only_base;   ///< cases that NEW lacks
  std::vector<std::string> only_fresh;  ///< cases that BASE lacks
  std::vector<std::string> ambiguous;   ///< cases that one side holds twice, so not compared
  /// Cases of equal keys that ran something else (case_id: mechanism, limits, ensemble, ...), so
  /// not compared.
  std::vector<std::string> other_content;
  /// Compared all the same, by options.match: the case and what differs (OtherSettings).
  std::vector<std::string> other_settings;

  int Count(Judgement judgement, std::string_view group = "") const;
  /// Why the comparison decides nothing, or "": no value was compared, no time of those that both
  /// sides have, or cases are missing (unless options allow it), ambiguous or of other content.
  std::string Obstacle(const CompareOptions& options) const;
  /// 1: something is worse or different. 2: there is an Obstacle(). 0: the same or better.
  int ExitCode(const CompareOptions& options) const;
};

ComparisonReport Compare(const std::vector<Record>& base, const std::vector<Record>& fresh,
                         const CompareOptions& options);

}  // namespace loopbench::harness
