// Reads the rules that turn results into verdicts (configs/experiments/paper/claims.json).
// What such a file may hold: docs/fields.md, claims.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "harness/json/schema.h"
#include "harness/judge/claims.h"

namespace loopbench::harness {

/// Reads a file. Throws ConfigError with all mistakes in it (unknown keys, wrong types, a threshold
/// missing or out of place, an id or a label used twice), each with file, JSON Pointer, value found
/// and what was expected.
std::vector<ClaimRule> ReadClaims(const std::filesystem::path& path);

/// The same from text; `file` is the name used in messages.
std::vector<ClaimRule> ParseClaims(std::string_view text, const std::string& file);

Json ClaimsSchema();

}  // namespace loopbench::harness
