// The rules by which measures (harness/record/measures.h) are compared: their groups, and what
// values they are made of.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "harness/record/measures.h"
#include "harness/record/record.h"

namespace loopbench::harness {

/// Groups of rules, as `--only` and the summary name them.
std::string_view GroupOf(Rule rule);
/// All of them.
const std::vector<std::string>& GroupNames();

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
std::string Shown(const Record& record, std::string_view key);

/// How fast the machine was when the time under `key` was measured: that of the yardstick [ns]
/// (harness/timing/yardstick.h), NaN where it is not known and of what is no time.
double YardstickOf(const Record& record, std::string_view key);

/// What tells cases of one store apart, as one line of text: the keys that stand first in a record,
/// before "case_id" or "outcome".
std::string CaseText(const Record& record);

/// The same of these keys alone, and of "kind", for runs and timings never stand for each other.
std::string CaseText(const Record& record, const std::vector<std::string>& keys);

/// What two records that are compared were run with that differs, "" when nothing does: "rtol 1e-09
/// before, 1e-06 now, content ...". Content is the mechanism, limits and ensemble
/// (harness/run/case_identity.h).
std::string OtherSettings(const Record& base, const Record& fresh);

}  // namespace loopbench::harness
