// What a comparison found, for those who do not read terminals: a pull request and a CI server.
#pragma once

#include <string>
#include <vector>

#include "harness/judge/compare.h"

namespace loopbench::harness {

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

}  // namespace loopbench::harness
