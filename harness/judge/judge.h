// Judgements of records: demands, comparisons, claims, robustness maps, work-precision.
#pragma once

#include <array>
#include <cstddef>
#include <filesystem>
#include <limits>
#include <map>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "harness/base/record.h"
#include "harness/judge/tables.h"

namespace loopbench::harness {

/// Returns the word of a value of an enumeration.
template <class Enum, std::size_t size>
std::string_view WordIn(const std::string_view (&words)[size], Enum value) {
  return words[static_cast<std::size_t>(value)];
}

inline constexpr double kNoNumber = std::numeric_limits<double>::quiet_NaN();

/// Returns the group of a rule, for `--only` and the summary.
std::string_view GroupOf(Rule rule);
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
/// (harness/run/timing.h); NaN if unknown or if the value is not a time.
double CalibrationOf(const Record& record, std::string_view key);

/// Returns the text that identifies a case of a store: the keys before "case_id", "outcome", "id"
/// or "version". With `keys`, only these and "kind", which separates runs from timings.
std::string CaseText(const Record& record, const std::vector<std::string>& keys = {});

/// Returns "drift 1, energy 2": each word with its number, in this format.
std::string CountWords(const std::vector<std::string>& words, std::string_view format = "{} {}");

/// Returns the cases that occur in several records.
std::set<std::string> RepeatedCases(std::span<const Record> records);

/// Returns the settings in which two compared records differ, or "": "rtol 1e-09 before, 1e-06 now,
/// content ...". Content is the mechanism, limits and ensemble (harness/run/run.h).
std::string OtherSettings(const Record& base, const Record& fresh);

/// Relation of a value to a number (at most, at least, equal, within a tolerance) or to a word.
enum class Relation { kAtMost, kAtLeast, kEqual, kWithin, kIs, kIsNot };

/// Demand on a measure: of a claim on a statistic of records, of a robustness map on every record
/// of a cell.
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
  double value = kNoNumber, limit = kNoNumber;     ///< measured, and the limit that was applied
  /// value / limit, or limit / value for lower limits: above 1 the limit is violated. Infinite for
  /// values that are not finite or not equal, 0 for equal values.
  double ratio = kNoNumber;
  double total = kNoNumber;  ///< for counts: total from Demand::of
  std::string reason = {};   ///< "energy_error_max = 0.016 [J], limit 5e-06", or the missing key
};

/// Returns true if a number, or a text, meets the demand. Non-finite numbers never do.
bool Meets(const Demand& demand, double value);
bool Meets(const Demand& demand, const std::string& text);

/// Evaluates a number of the record with the limit scaled by the record's `of`.
Judged Judge(const Demand& demand, const Record& record);

/// Returns "branch_error_max <= 500 rtol [rad]", or with a `subject` instead of the measure "max
/// drift <= 1". Numbers have three digits if `rounded`, otherwise all.
std::string ToText(const Demand& demand, const std::string& subject, bool rounded);
inline std::string ToText(const Demand& demand) { return ToText(demand, demand.measure, false); }

// Claims. A rule (configs/experiments/paper/claims.json) restates a claim as checks: each takes a
// statistic of one measure of selected records and compares it with a threshold.

/// One number of the selected rows (max, min, mean), or a demand on all of them or on any.
enum class Statistic { kMax, kMin, kMean, kAll, kAny };

/// Condition of a claim: a demand on a statistic of selected records.
struct Check {
  std::string label;      ///< the condition in words: "square four-bar, joint coordinates"
  Selection select;       ///< selection of records
  Selection relative_to;  ///< if not empty: records whose statistic is the divisor
  Selection require;      ///< conditions on every selected record; otherwise the check fails
  Demand demand;          ///< without `of` and `when`
  Statistic statistic = Statistic::kMax;
  bool failed_runs_hold = false;  ///< for checks that expect failure: unfinished runs hold
};

/// Sentence for each verdict, printed after it. Empty sentences are left out.
struct Wording {
  std::string reproduced, not_reproduced, only_under, not_measured;
};

struct ClaimRule {
  std::string id;
  std::string claim;  ///< claim in one sentence
  std::string where;  ///< section or figure of the paper
  std::string note;   ///< origin of the thresholds
  std::vector<Check> checks;
  Wording wording;
};

enum class CheckState { kHolds, kFails, kNotMeasured };

/// Result of a check.
struct CheckResult {
  std::string label;
  CheckState state = CheckState::kNotMeasured;
  std::size_t rows = 0;  ///< number of records, both sides of a ratio
  std::string measured;  ///< the numbers: "2.02 (1.98 .. 2.05)", "finished (3)"
  std::string expected;  ///< the demand: "mean growth_exponent = 2 +- 0.15"
  std::string reason;    ///< reason for failing or missing measurement, in addition to the numbers
  std::string remark;    ///< without effect on the state: flagged runs, an infinite ratio
};

enum class Verdict { kReproduced, kNotReproduced, kOnlyUnder, kNotMeasured };

/// Rule with the results of its checks.
struct ClaimResult {
  ClaimRule rule;
  std::vector<CheckResult> checks;
  Verdict verdict = Verdict::kNotMeasured;
  std::string text;  ///< verdict, conditions and wording, ready to print
};

/// Evaluates one check. Kinds of records without the measure (timing for a drift check) are
/// ignored, unless their run failed. If no record is left, the state is kNotMeasured.
/// An unfinished run ("outcome" other than "finished") or a record that violates `require` makes
/// the check fail. Failed runs are allowed if the check measures or selects the outcome, or if
/// failed_runs_hold. A missing or non-finite value, or a ratio 0 / 0, makes the check kNotMeasured,
/// because it may be decisive. A ratio x / 0 is infinite. A ratio of times is kNotMeasured if a
/// change of the machine's speed between them, measured by the calibration, may decide it.
CheckResult Evaluate(const Check& check, std::span<const Record> records);

/// Evaluates all checks of a rule. All hold: reproduced. None holds and at least one fails: not
/// reproduced. No check was measured: not measured. Otherwise "partially reproduced", with the
/// checks that hold, fail and are not measured.
ClaimResult Evaluate(const ClaimRule& rule, std::span<const Record> records);

inline std::string_view ToString(Verdict verdict) {
  return WordIn({"reproduced", "not reproduced", "partially reproduced", "not measured"}, verdict);
}
inline std::string_view ToString(CheckState state) {
  return WordIn({"holds", "fails", "not measured"}, state);
}

/// Reads a file, or a text with this name of its file (docs/fields.md, claims). Throws ConfigError
/// with all errors (unknown keys, wrong types, missing or misplaced thresholds, repeated ids or
/// labels), each with file, JSON Pointer, found and expected value.
std::vector<ClaimRule> ReadClaims(const std::filesystem::path& path);
std::vector<ClaimRule> ParseClaims(std::string_view text, const std::string& file);

/// Returns one row per claim: id, claim, section of the paper, verdict.
Table VerdictTable(std::span<const ClaimResult> results);

/// Returns a row per check of a claim: condition, expected, measured, rows, result, reason.
Table CheckTable(const ClaimResult& result);

/// Returns all verdicts as Markdown (results/paper/README.md), with `notes` (provenance, command)
/// at the end.
std::string ClaimsMarkdown(std::span<const ClaimResult> results,
                           const std::vector<std::string>& notes);

// Comparison of new measurements with a base, used as the gate of CI. Counts and hashes are
// compared exactly, errors and instructions by their ratio, times by a statistical test on one
// machine only. Incomparable values are reported with the reason, never counted as equal.

struct CompareOptions {
  /// Limit for errors with equal arithmetic: equal code gives equal bits.
  double error_ratio = 1.05;
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
inline std::string_view ToString(Judgement judgement) {
  return WordIn({"same", "better", "worse", "different", "not measured"}, judgement);
}

/// Result for one measure of one case.
struct Finding {
  std::string one = {};  ///< the case
  Measure measure = {};
  Judgement judgement = Judgement::kSame;
  std::string base = {}, fresh = {};  ///< as printed: numbers, medians, hashes
  double ratio = kNoNumber;           ///< new / base, if meaningful
  double p = kNoNumber;               ///< for times: p-value adjusted by Holm
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

// Robustness map: methods (columns) and stress tests (rows), each cell evaluated from records by
// the deciding measures of its row (configs/experiments/extremes/map.json).

/// Stress test: a row of the map.
struct MapRow {
  std::string label;
  Selection select;             ///< selection of records, with the column's selection
  std::vector<Demand> decides;  ///< demands that must all be met
  std::vector<std::string> right = {"finished"};      ///< expected outcomes of a run
  std::vector<bool> must_hold;                        ///< by column: true if required by the gate
  std::map<std::string, std::string> not_applicable;  ///< reason by column label
  std::string others_not_applicable;  ///< reason for all other columns not required, or ""
  std::size_t cases = 1;              ///< minimum number of records to hold
  std::string why;                    ///< origin of the limits
};

struct MapGroup {
  std::string label;
  std::string short_label;  ///< for pictures, or ""
  std::vector<MapRow> rows;
};

/// Method: a column of the map.
struct MapMethod {
  std::string label;
  Selection select;
};

struct MapRules {
  std::string title, comment;
  std::vector<MapMethod> columns;
  std::vector<MapGroup> groups;
};

/// State of a cell, from good to bad; the worst of several records decides. A wrong result without
/// an error is worse than a run that stops with a reason or does not end.
enum class CellState {
  kHolds,          ///< expected outcome, all demands met
  kNotApplicable,  ///< no record, and the rules contain a reason
  kNotMeasured,    ///< too few records, or a record without a deciding measure
  kStopped,        ///< ended early with a numerical reason: singular, locked, ...
  kLimit,          ///< stopped by a limit: step-limit, time-limit, ...
  kInaccurate,     ///< ended normally, but a demand is not met
  kBroken,         ///< crashed, or returned an invalid result
};
inline constexpr std::array kCellStates = {CellState::kHolds,        CellState::kStopped,
                                           CellState::kLimit,        CellState::kInaccurate,
                                           CellState::kBroken,       CellState::kNotMeasured,
                                           CellState::kNotApplicable};  ///< in the order of legends

inline std::string_view ToString(CellState state) {
  return WordIn(
      {"holds", "not applicable", "not measured", "stopped", "limit", "inaccurate", "broken"},
      state);
}

/// Outcomes that rules may name, and the state of a run with this outcome if it is not expected.
struct RunEnding {
  std::string_view word;
  CellState state;
};
inline constexpr std::array kRunEndings = {RunEnding{"finished", CellState::kInaccurate},
                                           RunEnding{"singular", CellState::kStopped},
                                           RunEnding{"step-too-small", CellState::kStopped},
                                           RunEnding{"non-finite", CellState::kStopped},
                                           RunEnding{"inconsistent-start", CellState::kStopped},
                                           RunEnding{"inconsistent-motion", CellState::kStopped},
                                           RunEnding{"locked", CellState::kStopped},
                                           RunEnding{"newton-failure", CellState::kStopped},
                                           RunEnding{"unsupported", CellState::kStopped},
                                           RunEnding{"step-limit", CellState::kLimit},
                                           RunEnding{"time-limit", CellState::kLimit},
                                           RunEnding{"process-time-limit", CellState::kLimit},
                                           RunEnding{"memory-limit", CellState::kLimit},
                                           RunEnding{"integrator-error", CellState::kBroken},
                                           RunEnding{"crashed", CellState::kBroken},
                                           RunEnding{"invalid-result", CellState::kBroken}};

/// Cell of the map, with its reasons.
struct MapCell {
  CellState state = CellState::kNotMeasured;
  /// Class: "singular", "time-limit", ... for an unexpected outcome, otherwise the state's name.
  std::string word = "not measured";
  std::string outcome, case_id;  ///< of the deciding run
  /// Deciding measure: the unmet measure furthest beyond its limit, otherwise the measure closest
  /// to its limit. Empty if the outcome decided.
  Judged decided;
  double t_reached = kNoNumber;  ///< [s]
  std::size_t holding = 0, records = 0;
  /// Number of holding runs with warnings, and the warning codes with counts: "energy 2".
  std::size_t flagged = 0;
  std::string warnings;
  std::size_t cases = 0;  ///< expected number of records, at least `records`
  std::string reason;     ///< text: all measures beyond their limits, the run's message, ...
  bool demanded = false;

  /// True if a holding run has a warning: a false alarm, or the map's demands are weaker.
  bool HoldsWithWarnings() const { return state == CellState::kHolds && flagged > 0; }
};

/// Evaluates one cell: its worst run. Only records of kind "accuracy" are used, unless a selection
/// names the kind.
MapCell JudgeCell(const MapRow& row, std::size_t column, const MapMethod& method,
                  std::span<const Record> records);

/// Rules, and the cells by group, row and column.
struct RobustnessMap {
  MapRules rules;
  std::vector<std::vector<std::vector<MapCell>>> cells;
  /// One sentence for each key of the rules that no record has: misspelt, or not run yet.
  std::vector<std::string> remarks;
};
RobustnessMap MakeRobustnessMap(const MapRules& rules, std::span<const Record> records);

/// Calls `visit` with group, row, column and cell of every cell, in the order of the rules.
template <class Map, class Visit>
void EachCell(Map& map, const Visit& visit) {
  for (std::size_t g = 0; g < map.cells.size(); ++g) {
    const MapGroup& group = map.rules.groups[g];
    for (std::size_t r = 0; r < map.cells[g].size(); ++r) {
      for (std::size_t c = 0; c < map.rules.columns.size(); ++c) {
        visit(group, group.rows[r], map.rules.columns[c], map.cells[g][r][c]);
      }
    }
  }
}

/// Returns the class, with the outcome if it is not "finished": "holds: locked".
std::string ClassText(const MapCell& cell);

/// Returns the deciding number: "branch 2.1e-09 rad", "397 of 400", "at 0.31 s"; or "".
std::string DecidingNumber(const MapCell& cell);

/// Returns "3/4" if more than one record exists or is expected, otherwise "".
std::string HoldingCount(const MapCell& cell);

/// Returns "O-DCA, position / parallelogram: singular at 0.31 s" for each required cell that does
/// not hold.
std::vector<std::string> BrokenDemands(const RobustnessMap& map);

/// Reads a file, or a text with this name of its file (docs/fields.md, map). Throws ConfigError
/// with all errors (unknown keys, wrong types, unknown outcomes or column labels, repeated labels,
/// rows without criteria), each with file, JSON Pointer, found and expected value.
MapRules ReadMapRules(const std::filesystem::path& path);
MapRules ParseMapRules(std::string_view text, const std::string& file);

/// Returns the map of these rules with the cells of robustness-map.csv (MapCellTable()), for
/// pictures: the original store is large and rarely kept. Each cell has its state and requirement;
/// numbers and reasons are not read.
///
/// @throws ConfigError with file, line and found text if the CSV is invalid or its cells differ
/// from the rules.
RobustnessMap MapFromCsv(const MapRules& rules, std::string_view csv, const std::string& file);

/// Returns "3 of 877 cells that hold have runs with warnings".
std::string CountFlagged(const RobustnessMap& map);

/// Returns one row per stress test and one column per method (by letter, named in the notes),
/// coloured by state on a terminal: "ok 2.1e-09", "singular at 0.31 s 3/4", "?" for not measured,
/// "-" for not applicable.
Table MapTable(const RobustnessMap& map);

/// Returns one row per cell with all deciding data in full precision: robustness-map.csv.
Table MapCellTable(const RobustnessMap& map);

/// Returns robustness-map.md: a table per group, the limits with reasons, and every cell that does
/// not hold with number and message. `notes` (provenance) are at the end.
std::string MapMarkdown(const RobustnessMap& map, const std::vector<std::string>& notes);

// Work-precision comparison: each accuracy run of a store with the time of the same case, the
// Pareto front of each problem, and the cheapest method of each formulation for an error. A run
// that failed or has warnings is a row with its reason, excluded from fronts and from the cheapest
// methods, because its error is unreliable.

struct WorkPrecisionOptions {
  /// Key of the error; "" for the first of UsualErrors() that records have.
  std::string error = "";
  /// Key of the cost, in accuracy records or in the timing of the same case. "wall_s" is the median
  /// of timed simulations, never the wall time of accuracy runs, which share the machine and are
  /// observed. "": "wall_s", or "rhs_equivalents" without timings.
  std::string cost = "";
  /// Rows with equal values of these keys form a problem; only rows of one problem are compared.
  std::vector<std::string> per = {"mechanism", "horizon"};
  std::vector<double> classes = {1e-3, 1e-6, 1e-9};  ///< error limits
  Selection where = {};  ///< selection of accuracy records, joined with their timings
};

/// Returns keys of errors, most reliable first: errors against a certified reference, errors
/// against exact motions, then indirect indicators of error.
std::span<const char* const> UsualErrors();

/// Returns true if an error is a distance [m] between points and a certified reference's points.
bool IsErrorOfPositions(const std::string& key);

/// Accuracy run with its cost.
struct WorkPrecisionRow {
  Record record;  ///< the run's record with additional keys of its timing
  Record timing;  ///< timing of the same case; without keys if there is none
  double error = kNoNumber, cost = kNoNumber;
  /// True if the measured error is not above the certified error of the reference. `error` is then
  /// an upper bound, the sum of both.
  bool is_bound = false;
  std::string reason = "";  ///< reason why it is not compared, or ""
  bool on_front = false;    ///< Pareto-optimal among the compared rows of its problem
};

/// Cheapest compared row of a formulation within an error limit.
struct Cheapest {
  double error_class = 0.0;
  std::string formulation;
  int row = -1;              ///< index into the problem's rows; -1: none
  double ratio = kNoNumber;  ///< cost relative to the cheapest of all formulations
};

/// Rows of one mechanism and horizon (WorkPrecisionOptions::per), cheapest first, rows without cost
/// last; and for each error limit the cheapest row of each formulation.
struct WorkPrecisionProblem {
  std::string name;  ///< "four-bar, horizon 10"
  std::vector<WorkPrecisionRow> rows;
  std::vector<Cheapest> cheapest;
};

struct WorkPrecision {
  std::string error;  ///< key of the error
  std::string cost;   ///< key of the cost; "wall_s_median" for "wall_s"
  std::vector<WorkPrecisionProblem> problems;
  std::vector<std::string> remarks;  ///< one sentence for each substituted key
};

/// @throws ConfigError if no accuracy record passes `where`, no record has the error or the cost,
/// or an option names a key that no record has.
WorkPrecision MakeWorkPrecision(std::span<const Record> records,
                                const WorkPrecisionOptions& options);

/// Returns the fairness of the comparison as lines. They name equal settings of the compared rows,
/// different settings with numbers of rows, and settings missing in records. Then follow the error
/// and the cost with their accuracy, and numbers of rows not compared with reasons. Warnings
/// ("warning: ...") are for costs that are incomparable times.
std::vector<std::string> FairnessStatement(const WorkPrecision& work_precision);

/// Rows and width of a table.
struct WorkPrecisionView {
  bool compact = true;  ///< few columns and short words, for a terminal of about 100 columns
  bool all = false;     ///< all rows; otherwise only the front and rows not compared
};

/// Returns rows in order of cost, grouped by problem. Rows on the front have a '*', rows not
/// compared their reason. A compact table omits constant columns. In a full table, "error" and
/// "cost" are numbers of one key each, named in the notes.
Table WorkPrecisionTable(const WorkPrecision& work_precision, const WorkPrecisionView& view);

/// Returns one row per problem and error limit, one column per formulation: the cost of its
/// cheapest method, the ratio to the cheapest of all, or "none".
Table OverviewTable(const WorkPrecision& work_precision);

/// Returns one row per problem, error limit and formulation with the method, error and cost:
/// work-precision-overview.csv.
Table CheapestTable(const WorkPrecision& work_precision);

/// Returns work-precision.md: overview, fairness statement, the cheapest methods, and all rows of
/// all problems. `notes` (provenance) are at the end.
std::string WorkPrecisionMarkdown(const WorkPrecision& work_precision,
                                  const std::vector<std::string>& notes);

// Measurements over commits, for trackers and for a table.

/// Tracked number; smaller is better.
struct TrackedValue {
  std::string benchmark, measure, unit = {};
  double value = 0.0;
  double lower = 0.0, upper = 0.0;  ///< spread; equal to value if there is none
  double least = 0.0;  ///< minimum of a sample, least disturbed by other work on the machine
  double calibration = kNoNumber;  ///< of the machine for times [ns]; NaN if unknown
};

/// github-action-benchmark, tool "customSmallerIsBetter":
///   [{"name": "<benchmark> <measure>", "unit", "value", "range": "lower .. upper"}]
/// `range` is left out without a spread. Values are finite.
std::string ToCustomSmallerIsBetter(const std::vector<TrackedValue>& values);

/// Bencher Metric Format: {benchmark: {measure: {"value", "lower_value", "upper_value"}}}. Units
/// are part of the measure's name, "cpu (ns)": the format has no place for them.
std::string ToBencherMetricFormat(const std::vector<TrackedValue>& values);

struct TrackedRecords {
  /// Counts, errors, instructions and times (median, with the 10th and 90th percentile as spread)
  /// of finished records, all finite; hashes and outcomes are excluded.
  std::vector<TrackedValue> values;
  /// Excluded values, one line each with case and reason: failed runs, invalid values,
  /// repeated cases.
  std::vector<std::string> left_out;
};
TrackedRecords TrackRecords(const std::vector<Record>& records);

}  // namespace loopbench::harness
