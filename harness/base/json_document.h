// Strict JSON parser, and readable JSON text of documents.
#pragma once

#include <cstddef>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <vector>

namespace loopbench::harness {

// Strict JSON parser: deviations that the library's parser accepts are errors here.
//
// For the .cpp files of harness/config and harness/base only, like json_reader.h and the
// *_sections.h: these headers include nlohmann-json. All readers use this parser, so limits of size
// and depth and messages are the same for all files.

/// JSON value with keys in the order of the file, which is also the order of messages.
using Json = nlohmann::ordered_json;

/// Size limit of files [bytes]; larger files are rejected without being read.
inline constexpr std::size_t kMaxConfigBytes = 16u << 20;

/// Limit of nesting depth, so that recursion over a document cannot exhaust the stack.
inline constexpr std::size_t kMaxConfigDepth = 64;

/// Maximum number of messages, to read files full of errors fast; further errors are counted.
inline constexpr std::size_t kMaxMessages = 100;

/// Returns the text of a file of at most kMaxConfigBytes. Throws ConfigError with file and reason.
std::string ReadTextFile(const std::filesystem::path& path);

/// Parses RFC 8259 JSON in UTF-8; `file` is the name used in messages.
///
/// Throws ConfigError. "FILE:LINE:COLUMN: found ..., expected ..." for other encodings, syntax
/// errors, comments, trailing commas, NaN, Infinity and text after the document; "FILE:LINE:
/// /pointer: ..." for nesting deeper than kMaxConfigDepth and, all at once, for keys that occur
/// twice in one object (the library's parser keeps only one of them) and numbers that are not zero
/// but too small for a double. Linear in the size of the text.
Json ParseDocument(std::string_view text, const std::string& file);

/// Returns the first line of the value at each pointer, counted from 1. Pointers without a value
/// are left out. `text` is a document that ParseDocument accepts.
std::map<std::string, std::size_t> LinesOf(std::string_view text,
                                           const std::vector<std::string>& pointers);

/// Returns `key` as one reference token of a JSON Pointer (RFC 6901): "~" and "/" escaped.
std::string PointerToken(std::string_view key);

/// Returns a pointer for messages: "(top level)" for "", and without the middle if it is long.
std::string ShownPointer(const std::string& pointer);

/// Returns the text with control characters escaped as in JSON, so that a message is one line.
std::string Printable(const std::string& text);

/// Returns "" for UTF-8 without byte order mark and zero bytes, or "LINE:COLUMN: found ...".
std::string EncodingFault(std::string_view text);

/// Returns "found ..., expected ... (hint)" from the parser's message about `text`. `position` is
/// the number of characters read, so that the offending token ends just before it.
std::string SyntaxMessage(const std::string& message, std::string_view text, std::size_t position);

/// Returns the last characters of a token, which may be megabytes long.
std::string ShortToken(const std::string& token);

/// Returns the value on one line without spaces; invalid UTF-8 is replaced.
std::string CompactText(const Json& value);

/// Returns the value on one line, with a space after each comma and colon.
std::string FlatText(const Json& value);

/// Returns the text of a file: a value on one line if it fits, otherwise one element per line,
/// indented by two. Lines have at most 100 characters if possible. Numbers keep their bits.
std::string JsonText(const Json& document);

}  // namespace loopbench::harness
