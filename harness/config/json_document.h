// From bytes to a JSON document, strictly: what the parser would forgive is an error here.
//
// Internal to harness/config, like json_reader.h and the *_sections.h: these headers show
// nlohmann-json, so only .cpp files of this folder may include them.
#pragma once

#include <cstddef>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

namespace loopbench::harness {

/// Keeps the order of the file, so that messages come in the order a reader meets their causes.
using Json = nlohmann::ordered_json;

/// Larger files are refused unread [bytes]: a configuration of this size is a mistake.
inline constexpr std::size_t kMaxConfigBytes = 16u << 20;

/// Deeper nesting is refused, so that no later recursion over the document can exhaust the stack.
inline constexpr std::size_t kMaxConfigDepth = 64;

/// The whole text of a file. Throws ConfigError naming the file and the reason (missing, a folder,
/// not readable, larger than kMaxConfigBytes).
std::string ReadTextFile(const std::filesystem::path& path);

/// Parses RFC 8259 JSON; `file` is the name used in messages.
///
/// Throws ConfigError with line and column for syntax errors, comments, trailing commas, NaN,
/// Infinity, numbers outside the range of a double, text after the document and nesting deeper than
/// kMaxConfigDepth; with JSON Pointers, all at once, for keys that occur twice in one object (the
/// parser would keep one of them without a word).
Json ParseDocument(std::string_view text, const std::string& file);

/// `key` as one reference token of a JSON Pointer (RFC 6901): "~" and "/" escaped.
std::string PointerToken(std::string_view key);

}  // namespace loopbench::harness
