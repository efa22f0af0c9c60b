// Kind of a configuration file, determined by its top-level keys only.
#pragma once

#include <filesystem>

namespace loopbench::harness {

enum class FileKind { kMechanism, kExperiment, kClaims, kMap, kBenchmarks, kSeries };

/// Returns the kind that has most of the file's top-level keys, including one of its characteristic
/// keys. If several kinds qualify, the kind with all its characteristic keys present is chosen.
/// Throws ConfigError if the file cannot be read or is not JSON, or if no kind or several kinds
/// remain; the message lists the keys found and the keys of each kind.
FileKind KindOfFile(const std::filesystem::path& path);

}  // namespace loopbench::harness
