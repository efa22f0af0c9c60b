// Reports of a history: its page, and the summary of a comparison.
#pragma once

#include <string>
#include <vector>

#include "harness/history/history_series.h"
#include "harness/judge/compare.h"

namespace loopbench::harness {

// Results of a comparison for pull requests and CI servers.

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

// A history as one HTML page: steps, commits, and a chart of each series.

/// Writes charts as SVG, without script; series with steps come first. Draws at most 200 and states
/// the number of omitted ones.
std::string HistoryPage(const History& history, const HistoryFindings& found,
                        const std::string& title, const std::vector<std::string>& provenance);

}  // namespace loopbench::harness
