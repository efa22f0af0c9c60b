// Claims about stored records: their file, verdicts and report.
#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "harness/judge/demand.h"
#include "harness/record/record.h"
#include "harness/record/select.h"
#include "harness/tables/table.h"

namespace loopbench::harness {

// Verdicts on claims, computed from records by rules.
//
// A rule (configs/experiments/paper/claims.json) restates one claim as checks. Each check selects
// records, takes a statistic of one measure and compares it with a threshold. The verdict depends
// on the checks only and is never written by hand.

/// Statistic of the selected rows: one number (max, min, mean), or a demand on every row or on at
/// least one row.
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
  std::string reproduced;
  std::string not_reproduced;
  std::string only_under;
  std::string not_measured;
};

/// Claim of the paper with its checks.
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
/// ignored, unless their run failed. If no record is left, the state is kNotMeasured, never kHolds.
/// An unfinished run ("outcome" other than "finished") or a record that violates `require` makes
/// the check fail. Failed runs are allowed if the check measures or selects the outcome, or if
/// failed_runs_hold. A missing or non-finite value makes the check kNotMeasured, because it may be
/// decisive. A ratio of times is kNotMeasured if a change of the machine's speed between them,
/// measured by the calibration, may decide it.
CheckResult Evaluate(const Check& check, std::span<const Record> records);

/// Evaluates all checks of a rule. All hold: reproduced. None holds and at least one fails: not
/// reproduced. No check was measured: not measured. Otherwise "partially reproduced", with the
/// checks that hold, fail and are not measured.
ClaimResult Evaluate(const ClaimRule& rule, std::span<const Record> records);

/// Returns "reproduced", "not reproduced", "partially reproduced" or "not measured".
std::string_view ToString(Verdict verdict);
/// "holds", "fails", "not measured".
std::string_view ToString(CheckState state);

// Reads the rules that turn results into verdicts (configs/experiments/paper/claims.json). Keys of
// the file: docs/fields.md, claims.

/// Reads a file. Throws ConfigError with all errors (unknown keys, wrong types, missing or
/// misplaced thresholds, repeated ids or labels), each with file, JSON Pointer, found and expected
/// value.
std::vector<ClaimRule> ReadClaims(const std::filesystem::path& path);

/// Reads rules from text; `file` is the name used in messages.
std::vector<ClaimRule> ParseClaims(std::string_view text, const std::string& file);

// Page of verdicts: every claim with its verdict and the measured numbers.

/// Returns one row per claim: id, claim, section of the paper, verdict.
Table VerdictTable(std::span<const ClaimResult> results);

/// Returns a row per check of a claim: condition, expected, measured, rows, result, reason.
Table CheckTable(const ClaimResult& result);

/// Returns all verdicts as Markdown (results/paper/README.md), with `notes` (provenance, command)
/// at the end.
std::string ClaimsMarkdown(std::span<const ClaimResult> results,
                           const std::vector<std::string>& notes);

}  // namespace loopbench::harness
