// What can be compared, and by which rule.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "harness/record/record.h"

namespace loopbench::harness {

/// How two values of a measure are held against each other.
enum class Rule {
  kOutcome,       ///< "finished" must stay "finished"
  kDoubts,        ///< what a run's own record says against it: no new reason may come (doubts.h)
  kEqual,         ///< a number that says what was measured: any change is a difference
  kCount,         ///< an exact count of work: more is worse, fewer is better
  kHash,          ///< equal bits
  kError,         ///< drift, energy error, ...: a ratio
  kInstructions,  ///< executed instructions: a ratio
  kTime,          ///< a sample of times: a test
};

/// Groups of rules, as `--only` and the summary name them.
std::string_view GroupOf(Rule rule);
/// All of them.
const std::vector<std::string>& GroupNames();

struct Measure {
  std::string key;  ///< in the record
  Rule rule = Rule::kEqual;
  std::string unit;  ///< of the value as compared
  /// Depends on the last bits of floating-point numbers, or on what the compiler makes of the code
  /// (alignment of memory): comparable under one arithmetic only (origin.h).
  bool needs_same_arithmetic = false;
};

/// All measures, in the order of reports.
const std::vector<Measure>& Measures();

/// What a record holds under the key of a measure.
enum class Held {
  kNothing,  ///< no such key
  kUnfit,    ///< another type, or a number that the measure cannot have (null stands for NaN)
  kFit,
};
Held HeldBy(const Record& record, const Measure& measure);

/// What values of a rule are, as messages put it: "a number >= 0".
std::string_view Expected(Rule rule);

/// The value under `key` as messages show it: null, "a text" in quotes, numbers as they are, of a
/// series how many values it has, and how many of them are unfit for a sample of times.
std::string Shown(const Record& record, const std::string& key);

/// What tells cases of one store apart, as one line of text: the keys that stand first in a record,
/// before "case_id" or "outcome".
std::string CaseText(const Record& record);

}  // namespace loopbench::harness
