// What is held to a limit: keys, relations, and the rules of measures.
#pragma once

#include <limits>
#include <string>
#include <string_view>
#include <vector>

#include "harness/record/measures.h"
#include "harness/record/record.h"

namespace loopbench::harness {

// The rules by which measures (harness/record/measures.h) are compared: their groups, and what
// values they are made of.

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

// One demand on one measure, and the one place that holds a value to it. A claim makes demands on
// a statistic of many records, a robustness map on every record of a cell, a comparison on a new
// value beside that of a base.

/// What a value must be: a number at most, at least, equal to or within a tolerance of another, or
/// a text equal to or different from a word.
enum class Relation { kAtMost, kAtLeast, kEqual, kWithin, kIs, kIsNot };

struct Demand {
  std::string measure = {};  ///< key in the record
  std::string name = {};     ///< short word for it in cells, "" for none
  std::string unit = {};     ///< of the measure, "" for counts
  Relation relation = Relation::kAtMost;
  double number = 0.0;
  std::string of =
      {};  ///< key that the number is a multiple of ("relative_to": 500 rtol), "" for none
  double tolerance = 0.0;                        ///< for kWithin
  std::string word = {};                         ///< for kIs and kIsNot
  std::vector<std::string> when = {"finished"};  ///< endings of runs that it applies to

  bool IsText() const { return relation == Relation::kIs || relation == Relation::kIsNot; }
};

/// What a demand found in a record.
struct Judged {
  bool measured = false, met = false;
  std::string measure = {}, name = {}, unit = {};  ///< the demand's
  double value = std::numeric_limits<double>::quiet_NaN();
  double limit = std::numeric_limits<double>::quiet_NaN();  ///< the one that applied
  /// value / limit, or limit / value where the limit is a least one: above 1 is beyond. Infinite
  /// for what is not finite or not equal, 0 for what is equal.
  double ratio = std::numeric_limits<double>::quiet_NaN();
  double total = std::numeric_limits<double>::quiet_NaN();  ///< of counts: that of Demand::of
  std::string reason = {};  ///< "energy_error_max = 0.016 [J], limit 5e-06", or what is missing
};

/// Whether a number is as demanded. What is not finite never is.
bool Meets(const Demand& demand, double value);
/// Whether a text is.
bool Meets(const Demand& demand, const std::string& text);

/// A number of the record against the limit that its own `of` gives.
Judged Judge(const Demand& demand, const Record& record);

/// "branch_error_max <= 500 rtol [rad]"; of a `subject` instead of the measure: "max drift <= 1".
/// Numbers have three digits where `rounded`, else all.
std::string ToText(const Demand& demand, const std::string& subject, bool rounded);
inline std::string ToText(const Demand& demand) { return ToText(demand, demand.measure, false); }

}  // namespace loopbench::harness
