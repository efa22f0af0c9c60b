// What a configuration file is about, as far as its text tells before it is read.
#pragma once

#include <filesystem>

namespace loopbench::harness {

enum class FileKind { kMechanism, kExperiment, kClaims, kMap, kBenchmarks };

/// By the one key that each kind must have and the others lack: "scenes", "claims", "rows",
/// "groups"; all else is taken for a mechanism. Throws ConfigError when the file cannot be read.
FileKind KindOfFile(const std::filesystem::path& path);

}  // namespace loopbench::harness
