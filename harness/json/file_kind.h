// What a configuration file is about: decided by the keys of its top level, never by names or texts
// further inside.
#pragma once

#include <filesystem>

namespace loopbench::harness {

enum class FileKind { kMechanism, kExperiment, kClaims, kMap, kBenchmarks, kSeries };

/// The kind that knows the most of the file's top-level keys, and among them at least one that
/// tells it apart; of several such kinds the one of which all of these are there. Throws
/// ConfigError when the file cannot be read or is no JSON, and when that leaves no kind or several;
/// the message then says which keys were found and what each kind has.
FileKind KindOfFile(const std::filesystem::path& path);

}  // namespace loopbench::harness
