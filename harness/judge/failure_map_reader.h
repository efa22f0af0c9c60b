// Reads the rules of a failure map (configs/experiments/extremes/map.json).
// What such a file may hold: docs/fields.md, map.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "harness/json/schema.h"
#include "harness/judge/failure_map.h"

namespace loopbench::harness {

/// Reads a file. Throws ConfigError with all mistakes in it (unknown keys, wrong types, an ending
/// or a column label that does not exist, a label used twice, a row that nothing decides), each
/// with file, JSON Pointer, value found and what was expected.
MapRules ReadMapRules(const std::filesystem::path& path);

/// The same from text; `file` is the name used in messages.
MapRules ParseMapRules(std::string_view text, const std::string& file);

Json MapSchema();

}  // namespace loopbench::harness
