// Reads the rules that turn results into verdicts (configs/experiments/paper/claims.json).
//
// The file is an object with one key, "claims", a list of
//   {"id", "claim", "where", "note", "select": {...}, "checks": [...], "wording": {"reproduced",
//    "not_reproduced", "only_under", "not_measured"}}
// where "select" joins the selections of every check, and each check is
//   {"label", "select": {key: value or list}, "measure", "statistic": "max|min|mean|all|any",
//    "compare": "<=|>=|within|is|is-not", "threshold", "tolerance", "word", "relative_to": {...},
//    "require": {...}, "failed_runs": "fail|hold"}.
// "threshold" belongs to the first three comparisons, "tolerance" to "within", "word" to "is" and
// "is-not"; "note", "wording", the rule's "select", "relative_to", "require" and "failed_runs" may
// be left out.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "harness/judge/claims.h"

namespace loopbench::harness {

/// Reads a file. Throws ConfigError with all mistakes in it (unknown keys, wrong types, a threshold
/// missing or out of place, an id or a label used twice), each with file, JSON Pointer, value found
/// and what was expected.
std::vector<ClaimRule> ReadClaims(const std::filesystem::path& path);

/// The same from text; `file` is the name used in messages.
std::vector<ClaimRule> ParseClaims(std::string_view text, const std::string& file);

}  // namespace loopbench::harness
