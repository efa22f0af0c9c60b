// Demands on measures: keys, relations, and rules of comparison.
#pragma once

#include <limits>
#include <string>
#include <string_view>
#include <vector>

#include "harness/record/measures.h"
#include "harness/record/record.h"

namespace loopbench::harness {

// Rules for the comparison of measures (harness/record/measures.h): their groups and valid values.

/// Returns the group of a rule, for `--only` and the summary.
std::string_view GroupOf(Rule rule);
/// Returns all groups.
const std::vector<std::string>& GroupNames();

/// State of a record's value for a measure.
enum class Presence {
  kNothing,  ///< no such key
  kUnfit,    ///< wrong type or invalid number (null is NaN)
  kFit,
};
Presence PresenceOf(const Record& record, const Measure& measure);

/// Returns the valid values of a rule for messages: "a number >= 0".
std::string_view Expected(Rule rule);

/// Returns the value under `key` for messages: null, a text in quotes, a number, or for a series
/// the number of values and of values invalid as times.
std::string Shown(const Record& record, std::string_view key);

/// Returns the calibration time [ns] of the machine for the time under `key`
/// (harness/timing/calibration.h); NaN if unknown or if the value is not a time.
double CalibrationOf(const Record& record, std::string_view key);

/// Returns the text that identifies a case of a store: the keys before "case_id" or "outcome" in
/// the record.
std::string CaseText(const Record& record);

/// Returns the text of these keys and "kind" only; "kind" separates runs from timings.
std::string CaseText(const Record& record, const std::vector<std::string>& keys);

/// Returns the settings in which two compared records differ, or "": "rtol 1e-09 before, 1e-06 now,
/// content ...". Content is the mechanism, limits and ensemble (harness/run/case_identity.h).
std::string OtherSettings(const Record& base, const Record& fresh);

// Demand on a measure, and its evaluation. A claim makes demands on a statistic of records, a
// robustness map on every record of a cell, a comparison on a new and a base value.

/// Relation of a value: a number at most, at least, equal to or within a tolerance of another
/// number, or a text equal to or different from a word.
enum class Relation { kAtMost, kAtLeast, kEqual, kWithin, kIs, kIsNot };

struct Demand {
  std::string measure = {};  ///< key in the record
  std::string name = {};     ///< short name for cells, or ""
  std::string unit = {};     ///< of the measure, "" for counts
  Relation relation = Relation::kAtMost;
  double number = 0.0;
  std::string of = {};     ///< key that multiplies the number ("relative_to": 500 rtol), or ""
  double tolerance = 0.0;  ///< for kWithin
  std::string word = {};   ///< for kIs and kIsNot
  std::vector<std::string> when = {"finished"};  ///< outcomes of runs to which it applies

  bool IsText() const { return relation == Relation::kIs || relation == Relation::kIsNot; }
};

/// Result of a demand for a record.
struct Judged {
  bool measured = false, met = false;
  std::string measure = {}, name = {}, unit = {};  ///< the demand's
  double value = std::numeric_limits<double>::quiet_NaN();
  double limit = std::numeric_limits<double>::quiet_NaN();  ///< limit that was applied
  /// value / limit, or limit / value for lower limits: above 1 the limit is violated. Infinite for
  /// values that are not finite or not equal, 0 for equal values.
  double ratio = std::numeric_limits<double>::quiet_NaN();
  double total = std::numeric_limits<double>::quiet_NaN();  ///< for counts: total from Demand::of
  std::string reason = {};  ///< "energy_error_max = 0.016 [J], limit 5e-06", or the missing key
};

/// Returns true if a number meets the demand. Non-finite numbers never do.
bool Meets(const Demand& demand, double value);
/// Returns true if a text meets the demand.
bool Meets(const Demand& demand, const std::string& text);

/// Evaluates a number of the record with the limit scaled by the record's `of`.
Judged Judge(const Demand& demand, const Record& record);

/// Returns "branch_error_max <= 500 rtol [rad]", or with a `subject` instead of the measure "max
/// drift <= 1". Numbers have three digits if `rounded`, otherwise all.
std::string ToText(const Demand& demand, const std::string& subject, bool rounded);
inline std::string ToText(const Demand& demand) { return ToText(demand, demand.measure, false); }

}  // namespace loopbench::harness
