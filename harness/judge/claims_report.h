// Verdicts as a page: every claim with its verdict, and below it the numbers it follows from.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "harness/judge/claims.h"
#include "harness/tables/table.h"

namespace loopbench::harness {

/// One row per claim: id, claim, place in the paper, verdict.
Table VerdictTable(std::span<const ClaimResult> results);

/// One row per check of a claim: condition, expected, measured, number of rows, result, reason.
Table CheckTable(const ClaimResult& result);

/// All verdicts as Markdown (results/paper/README.md), `notes` (provenance, the command) at the
/// end.
std::string ClaimsMarkdown(std::span<const ClaimResult> results,
                           const std::vector<std::string>& notes);

}  // namespace loopbench::harness
