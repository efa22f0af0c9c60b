// What a configuration file is about: decided by the keys of its top level, never by names or texts
// further inside.
#pragma once

#include <filesystem>

namespace loopbench::harness {

enum class FileKind { kMechanism, kExperiment, kClaims, kMap, kBenchmarks };

/// The kind that knows the most of the file's top-level keys. Throws ConfigError when the file
/// cannot be read or is no JSON, and when no kind or several know the most of its keys; the message
/// then says which keys were found and what each kind has.
FileKind KindOfFile(const std::filesystem::path& path);

}  // namespace loopbench::harness
