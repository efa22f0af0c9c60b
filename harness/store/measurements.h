// Measurements from any source as records: a result store, or the JSON of Google Benchmark.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "harness/record/record.h"

namespace loopbench::harness {

/// Returns the records of a folder with results.jsonl, of a .jsonl file, or of any other file as
/// JSON of Google Benchmark. A case with several records in the store (equal "case_id") is returned
/// once, with its last record. Throws std::runtime_error with the file and its error. Benchmark
/// files have the limits of configurations (ReadTextFile, ParseDocument).
std::vector<Record> ReadMeasurements(const std::filesystem::path& path,
                                     std::vector<std::string>* warnings = nullptr);

/// Returns the runs in the JSON of Google Benchmark, one record per benchmark, kind "benchmark".
/// Keys: "benchmark" (its name), "outcome" ("finished", or the error message), "start_hash" (its
/// label), "series.cpu_ns" and "series.real_ns" (one value per repetition), "cpu_ns" (their
/// median), the counters (median over the repetitions) by name, the origin's keys from the context,
/// and "load_average" (of the minute before). Aggregates, also complexity rows, are left out.
/// `file` is for messages. Throws ConfigError with all deviations from the library's format, each
/// with line, pointer and value, such as a null number or an unknown unit.
std::vector<Record> ParseBenchmarkJson(std::string_view text, const std::string& file);

}  // namespace loopbench::harness
