// Claims on stored records: their file, verdicts and report.
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
// records, takes a statistic of one measure and compares it with a threshold. The verdict follows
// from the checks alone, so that other data turn it and nobody writes it by hand.

/// What is made of the selected rows: one number (max, min, mean), or a demand on every row or on
/// at least one.
enum class Statistic { kMax, kMin, kMean, kAll, kAny };

/// One condition under which the claim is examined: a demand on the statistic of some records.
struct Check {
  std::string label;      ///< the condition in words: "square four-bar, joint coordinates"
  Selection select;       ///< which records
  Selection relative_to;  ///< when not empty: the statistic is divided by that of these records
  Selection require;      ///< what every selected record must also satisfy, or the check fails
  Demand demand;          ///< without `of` and `when`
  Statistic statistic = Statistic::kMax;
  bool failed_runs_hold =
      false;  ///< for checks that expect failure: a run that did not finish holds
};

/// A sentence for each verdict, printed after it. Empty sentences are left out.
struct Wording {
  std::string reproduced;
  std::string not_reproduced;
  std::string only_under;
  std::string not_measured;
};

/// One claim of the paper and how it is examined.
struct ClaimRule {
  std::string id;
  std::string claim;  ///< in our own words
  std::string where;  ///< section or figure of the paper
  std::string note;   ///< where the thresholds come from
  std::vector<Check> checks;
  Wording wording;
};

enum class CheckState { kHolds, kFails, kNotMeasured };

/// What one check found.
struct CheckResult {
  std::string label;
  CheckState state = CheckState::kNotMeasured;
  std::size_t rows = 0;  ///< records examined, both sides of a ratio
  std::string measured;  ///< the numbers: "2.02 (1.98 .. 2.05)", "finished (3)"
  std::string expected;  ///< the demand: "mean growth_exponent = 2 +- 0.15"
  std::string reason;    ///< why it fails or is not measured, beyond the numbers
};

enum class Verdict { kReproduced, kNotReproduced, kOnlyUnder, kNotMeasured };

/// A rule with what its checks found.
struct ClaimResult {
  ClaimRule rule;
  std::vector<CheckResult> checks;
  Verdict verdict = Verdict::kNotMeasured;
  std::string text;  ///< verdict, conditions and wording, ready to print
};

/// Examines one check. Records of a kind of which none that matches `select` has the measure
/// (timing next to drift) do not count, unless their run failed. With no record left the state is
/// kNotMeasured, never kHolds. A run that did not finish (an "outcome" other than "finished") or a
/// record that misses `require` makes the check fail. Failed runs are admitted where the check
/// measures or selects the outcome, or where failed_runs_hold. Otherwise a value that is missing or
/// not finite leaves the check kNotMeasured: it may decide. A ratio of times is kNotMeasured if a
/// change of the machine's speed between them, measured by the yardstick, may decide it.
CheckResult Evaluate(const Check& check, std::span<const Record> records);

/// Examines all checks of a rule. All hold: reproduced. None holds and at least one fails: not
/// reproduced. No check was measured: not measured. Everything else is "only under", naming the
/// checks that hold, those that fail and those not measured.
ClaimResult Evaluate(const ClaimRule& rule, std::span<const Record> records);

/// "reproduced", "not reproduced", "only under", "not measured".
std::string_view ToString(Verdict verdict);
/// "holds", "fails", "not measured".
std::string_view ToString(CheckState state);

// Reads the rules that turn results into verdicts (configs/experiments/paper/claims.json).
// What such a file may hold: docs/fields.md, claims.

/// Reads a file. Throws ConfigError with all mistakes in it (unknown keys, wrong types, a threshold
/// missing or out of place, an id or a label used twice), each with file, JSON Pointer, value found
/// and what was expected.
std::vector<ClaimRule> ReadClaims(const std::filesystem::path& path);

/// The same from text; `file` is the name used in messages.
std::vector<ClaimRule> ParseClaims(std::string_view text, const std::string& file);

// Verdicts as a page: every claim with its verdict, and below it the numbers it follows from.

/// One row per claim: id, claim, place in the paper, verdict.
Table VerdictTable(std::span<const ClaimResult> results);

/// One row per check of a claim: condition, expected, measured, number of rows, result, reason.
Table CheckTable(const ClaimResult& result);

/// All verdicts as Markdown (results/paper/README.md), `notes` (provenance, the command) at the
/// end.
std::string ClaimsMarkdown(std::span<const ClaimResult> results,
                           const std::vector<std::string>& notes);

}  // namespace loopbench::harness
