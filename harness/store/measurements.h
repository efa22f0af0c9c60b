// Whatever holds measurements, read as records: a result store, or the JSON of Google Benchmark.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "harness/record/record.h"

namespace loopbench::harness {

/// Records of a folder with results.jsonl, of a .jsonl file, or of any other file as the JSON of
/// Google Benchmark. A case that the store holds several times (equal "case_id") is there once, as
/// its last record. Throws std::runtime_error that names the file and what is wrong with it.
/// Benchmark files are held to the limits of configurations (ReadTextFile, ParseDocument).
std::vector<Record> ReadMeasurements(const std::filesystem::path& path,
                                     std::vector<std::string>* warnings = nullptr);

/// The runs in the JSON of Google Benchmark, one record per benchmark, kind "benchmark":
/// "benchmark" (its name), "outcome" ("finished", or the message of its error), "start_hash" (its
/// label), "series.cpu_ns" and "series.real_ns" (one per repetition), "cpu_ns" (their median), the
/// counters (median over the repetitions) under their own names, the origin's keys from the
/// context, and "load_average" (of the minute before). Aggregates, complexity rows among them, are
/// left out. `file` is for messages. Throws ConfigError with all that is not as the library writes
/// it, each with line, pointer and value: a null where a number belongs, a unit it does not have.
std::vector<Record> ParseBenchmarkJson(std::string_view text, const std::string& file);

}  // namespace loopbench::harness
