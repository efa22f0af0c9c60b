// Reads what is benchmarked (configs/benchmarks/default.json):
//   {"name", "comment", "states", "integrator", "step",
//    "groups": [{"mechanisms": [path, ...]  or  "family": "chain|ladder|grid", "sizes": [...],
//                "in_space": false, "compile": false,
//                "measure": ["rhs", "step"], "columns": [...]}]}
// Paths are relative to the file; columns are those of experiments. "states" names a file of
// hashes, which loopbench_bench --save-states writes:
//   {"<member>/<coordinates>": "<16 hexadecimal digits>"}
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "harness/config/benchmarks.h"

namespace loopbench::harness {

/// Reads the file, the mechanisms and the states it names. Throws ConfigError with all mistakes,
/// each with file, JSON Pointer, value found, what was expected and the nearest spelling.
BenchmarkSet ReadBenchmarks(const std::filesystem::path& path);

/// The same from text; `path` names it in messages and is what relative paths start from.
BenchmarkSet ParseBenchmarks(std::string_view text, const std::filesystem::path& path);

/// The text of a file of hashes.
std::string StatesToJson(const StateHashes& states);

}  // namespace loopbench::harness
