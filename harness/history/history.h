// Measurements over commits: git, folders of a history, series, change points, pages.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "harness/base/record.h"
#include "harness/base/text.h"
#include "harness/judge/judge.h"
#include "harness/judge/tables.h"

namespace loopbench::harness {

// Detection of level changes in a series of numbers, robust to outliers:
// P. Fearnhead, G. Rigaill, "Changepoint detection in the presence of outliers", Journal of the
// American Statistical Association 114 (2019) 169-183: minimal penalised cost with the biweight
// loss min((x - mu)^2, K^2), computed exactly by functional pruning (R-FPOP, a variant of PELT for
// bounded losses). An isolated outlier costs at most K^2 and thus causes no change.

/// Returns the first indices of all segments except the first, ascending.
/// @param x  finite values
/// @param bound  K > 0: values farther from their level are outliers
/// @param penalty  per change, in the unit of the cost: x squared
std::vector<std::size_t> RobustSegments(std::span<const double> x, double bound, double penalty);

/// Noise of a series between its changes: an autoregressive process of order 1.
struct Noise {
  double sigma = 0.0;        ///< standard deviation about its level
  double correlation = 0.0;  ///< correlation of neighbours, 0 to 0.9: slow phases of a machine last

  /// Returns the long-run standard deviation: means vary as for independent values with it.
  double LongRun() const;
};

/// Estimates noise from the mean squares of x[i+k] - x[i] for k = 1, 2, 3. Differences above 3.5
/// times the median-implied value of normal noise come from steps and outliers and are ignored, at
/// most a quarter. The growth with k gives the correlation, reduced by n^2 / (n^2 + 15^2) because
/// few values may imitate any. Similar estimates: G. Romano, G. Rigaill, V. Runge, P. Fearnhead,
/// "Detecting abrupt changes in the presence of local fluctuations and autocorrelated noise",
/// Journal of the American Statistical Association 117 (2022) 2147-2162. Returns no noise below
/// four values.
Noise NoiseOf(std::span<const double> x);

/// A change of level in a series of logarithms: a ratio.
struct LevelChange {
  std::size_t at = 0;                ///< first value of the new level
  double before = 0.0, after = 0.0;  ///< medians of the segments
  /// Expected number of changes at least as clear by noise alone, at all tested positions together.
  double expected = 0.0;

  double Confidence() const { return std::max(0.0, 1.0 - expected); }
};

/// Prior knowledge about a series.
struct Resolution {
  double noise = 0.0;   ///< minimum standard deviation that is assumed
  double least = 0.0;   ///< smaller changes are ignored
  double places = 0.0;  ///< number of tested positions: values of this series and all others
};

/// Maximum accepted number of changes by noise alone, at all tested positions together.
inline constexpr double kFalseAlarms = 0.01;

/// Finds the changes of a series. Candidates come from RobustSegments() with bound 3 sigma (as by
/// the authors) and the usual penalty, 2 log(n) times the long-run variance. The least certain
/// candidate is removed repeatedly, until all changes are at least resolution.least and noise is
/// expected to cause at most kFalseAlarms at all tested positions (Bonferroni). The probabilities
/// of two causes are added:
///   - Segment means differ by noise: normal tail for their standard error. It uses the long-run
///     standard deviation plus two of its own standard errors.
///   - The shorter segment consists of outliers of its neighbour: binomial tail for the number of
///     values beyond half of the step, with the share beyond 3 sigma in the series.
std::vector<LevelChange> FindChanges(std::span<const double> x, const Resolution& resolution);

// Location of a history: a folder, or a branch of its own in the git repository here.

/// Checked-out commit and its date (ISO 8601, UTC); both "" outside of a repository.
struct CheckedOut {
  std::string commit, date;
};
/// @param commit  a commit in any notation of git
/// Throws ConfigError if there is no git.
CheckedOut FindCommit(const std::string& commit = "HEAD");

/// Either a folder or a branch, as given by users.
struct HistoryPlace {
  std::filesystem::path store;
  std::string branch;
};

/// An open history.
struct OpenHistory {
  std::filesystem::path folder;
  /// Rewrites a message for users: for a branch, the folder is temporary.
  std::function<std::string(std::string)> named;
};

/// Calls `read` with the history; the files of a branch are then in a temporary folder. Errors
/// contain the branch instead of its folder. Throws ConfigError if not exactly one of both is
/// given, or without git or a repository. It also does so for an absent branch, an invalid name,
/// and a branch with files but no history.jsonl. Throws std::runtime_error with the message of git.
void ReadPlace(const HistoryPlace& place, const std::function<void(const OpenHistory&)>& read);

/// Calls `change`, which returns the commit message for the branch, and commits all changes. If
/// another process has changed the branch meanwhile, calls it again on the new state. The author is
/// the user, or "loopbench" if git has no user. The user's index, work tree, hooks and settings
/// have no effect. Throws as ReadPlace(), and ConfigError if the branch is checked out anywhere.
/// @param may_begin  creates an absent branch
void ChangePlace(const HistoryPlace& place, bool may_begin,
                 const std::function<std::string(const OpenHistory&)>& change);

// Measurements of successive commits: a folder that only grows.
//
//   DIR/history.jsonl     a line for each added commit and each mark
//   DIR/results/*.jsonl   measurements, without time series of runs but with samples of run times

/// Measurements of a commit on a machine.
struct HistoryEntry {
  std::string commit, date;  ///< date: ISO 8601 in UTC, of the commit
  std::string machine = {};  ///< processor model and number of logical processors
  std::filesystem::path results = {};
  std::string mark = {};  ///< good, accepted, bad, or "" if unmarked
  std::string note = {};
};

/// Returns the first twelve digits of a hash; other names unchanged.
std::string ShortCommit(const std::string& commit);

struct History {
  std::vector<HistoryEntry> entries;  ///< by date; equal dates in order of addition
  std::vector<std::string> warnings;  ///< incomplete lines after a crash
};

/// Throws ConfigError if the folder has no history, std::runtime_error as ReadRecords().
History ReadHistory(const std::filesystem::path& folder);

/// Reads the measurements of an entry, each case once. Throws std::runtime_error as ReadRecords();
/// incomplete lines go to `warnings`.
std::vector<Record> ReadResults(const HistoryEntry& entry, std::vector<std::string>* warnings);

/// Adds the measurements of a commit; creates the folder. Waits while another process adds. Throws
/// ConfigError if this machine already has the commit (unless `replaces`), for an invalid date, for
/// records of several machines, or if no record has an outcome. A replaced entry loses its mark,
/// except `accepted`; its results file remains.
/// @param entry  commit and date; the other members follow from the records
/// @param warnings  as in History
HistoryEntry AddToHistory(const std::filesystem::path& folder, HistoryEntry entry,
                          const std::vector<Record>& records, bool replaces,
                          std::vector<std::string>* warnings = nullptr);

/// A mark to set on a commit.
struct Mark {
  std::string commit;  ///< full name, or a prefix if no commit has that name
  std::string mark, note = {};
  bool keeps_accepted = false;  ///< do not overwrite an existing `accepted` mark
};
/// Marks a commit on all machines; returns it in full. Throws ConfigError unless one matches.
Mark MarkInHistory(const std::filesystem::path& folder, Mark mark,
                   std::vector<std::string>* warnings = nullptr);

/// Returns the baseline for new measurements of `machine`: its last entry marked good or accepted,
/// or a later entry accepted on another machine. Otherwise: the last entry so marked on any
/// machine. Without marks: the last entry that is not bad, on this machine if possible. Prefers
/// measurements of that commit on `machine`.
std::optional<HistoryEntry> LastGood(const History& history, const std::string& machine);

/// Returns the baseline for times: entries of this machine come first, marked or not.
std::optional<HistoryEntry> LastGoodOfMachine(const History& history, const std::string& machine);

// Series of measurements over commits, and their steps.

/// Value of a commit in a series.
struct HistoryValue {
  std::size_t entry = 0;            ///< index into the history
  double value = 0.0, upper = 0.0;  ///< for times: minimum and 90th percentile
  double calibration = 0.0;         ///< for times [ns], NaN if unknown
  /// False for times measured while the machine was slower or faster than usual at that time; true
  /// if its speed is unknown. Unsteady values are not used for levels.
  bool is_steady = true;
  /// For times: variation of the entry common to all cases, without changes of level; 1 if there
  /// are few cases or none with a measurable time.
  double common = 1.0;
};

/// One measure of one case on one machine.
struct HistorySeries {
  std::string machine, one;  ///< one: the case, or kAllCases
  std::string measure, unit;
  Rule rule = Rule::kNone;
  std::vector<HistoryValue> values = {};
  /// at: index into `values`; levels: medians of the values. For times found after removing the
  /// common variation, the levels are without it too.
  std::vector<LevelChange> changes = {};

  std::size_t Unsteady() const;  ///< number of values at another speed of the machine
};

/// Case of the pooled series of times: median over all cases of their ratios to their own medians.
/// It shows changes that are common to all cases but too small in each.
inline constexpr const char* kAllCases = "all cases";

/// Change of the outcome or of the warnings of a case since the previous commit.
struct EndingChange {
  std::string machine, one, measure;  ///< measure: "outcome" or "warnings"
  std::size_t entry = 0;              ///< index into the history
  std::string before, after;
};

struct HistoryFindings {
  std::vector<HistorySeries> series;
  std::vector<EndingChange> endings;
  std::vector<std::string> warnings;  ///< incomplete lines of results

  std::size_t Steps() const;  ///< number of changes in series and endings
};

/// Finds all series with their changes. Times use steady values only; those of five and more cases
/// are also pooled. A change of the pooled series is kept if the median change
/// of its cases is at least half as large. Throws std::runtime_error if a results file cannot be
/// read.
HistoryFindings FindingsOf(const History& history);

/// Returns a row for each step, newest first, outcomes before levels. "ratio" may be empty.
Table StepTable(const History& history, const HistoryFindings& found);

/// Returns the number of omitted times as a sentence; nothing if there are none.
std::optional<std::string> UnsteadyNote(const HistoryFindings& found);

// Reports: the summary of a comparison for pull requests and CI servers, and the page of a history.

/// Returns Markdown: the conclusion, worse or different measures (at most 50 rows and the number of
/// others), and the number of compared measures. `notes` follow.
std::string ComparisonMarkdown(const ComparisonReport& report, const std::string& conclusion,
                               const std::vector<std::string>& notes);

/// Returns JUnit XML for Jenkins and GitLab: a test case for each measure of each case. Failures
/// are worse or different measures and missing cases. Measures without a value are skipped. An
/// empty comparison is one error: a comparison with exit status 1 or 2 always gives a failure or an
/// error.
/// @param options  options of the comparison
std::string ComparisonJunit(const ComparisonReport& report, const CompareOptions& options);

/// Returns one HTML page: steps, commits, and a chart of each series as SVG, without script; series
/// with steps come first. Draws at most 200 and states the number of omitted ones.
std::string HistoryPage(const History& history, const HistoryFindings& found,
                        const std::string& title, const std::vector<std::string>& provenance);

}  // namespace loopbench::harness
