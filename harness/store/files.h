// Whole files, read and written at once.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

namespace loopbench::harness {

/// Writes `text` to `path` so that a reader finds the old file or the new one, never a part: the
/// text goes to a temporary file beside `path`, which then takes its name by rename(2). Missing
/// parent folders are made. Throws std::runtime_error that names the path and the system's reason.
void WriteFileAtomically(const std::filesystem::path& path, std::string_view text);

/// Throws std::runtime_error: "cannot VERB 'PATH': " and what errno says.
[[noreturn]] void FailOn(std::string_view verb, const std::filesystem::path& path);

/// The bytes of `path`. Throws std::runtime_error that names the path and the system's reason.
std::string ReadFile(const std::filesystem::path& path);

}  // namespace loopbench::harness
