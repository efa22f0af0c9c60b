// What people read of a history: its page, and the summary of a comparison.
#pragma once

#include <string>
#include <vector>

#include "harness/history/history_series.h"
#include "harness/judge/compare.h"

namespace loopbench::harness {

// What a comparison found, for those who do not read terminals: a pull request and a CI server.

/// Markdown: the conclusion, what is worse or different (at most 50 rows, with a sentence about the
/// rest), how many measures were compared. `notes` stand below.
std::string ComparisonMarkdown(const ComparisonReport& report, const std::string& conclusion,
                               const std::vector<std::string>& notes);

/// JUnit XML, as Jenkins and GitLab read it: a test case for each measure of each case. Failures
/// are what is worse or different, and cases that are missing; skipped is what could not be
/// measured. Where nothing was compared at all one error says so: no file without a failure or an
/// error belongs to a comparison that ended with 1 or 2.
/// @param options  of the comparison
std::string ComparisonJunit(const ComparisonReport& report, const CompareOptions& options);

// A history as one page of HTML: the steps, the commits, and a chart of each series.

/// Charts are SVG in the page, without script; those with steps stand first. At most 200 are drawn,
/// and the page says how many are not.
std::string HistoryPage(const History& history, const HistoryFindings& found,
                        const std::string& title, const std::vector<std::string>& provenance);

}  // namespace loopbench::harness
