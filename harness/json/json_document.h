// From bytes to a JSON document, strictly, and from a document to text as people read it.
#pragma once

#include <cstddef>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <vector>

namespace loopbench::harness {

// From bytes to a JSON document, strictly: what the parser would forgive is an error here.
//
// For the .cpp files of harness/config and harness/store only, like json_reader.h and the
// *_sections.h: these headers show nlohmann-json. Every reader of a document begins here, so that
// all have the same limits of size and depth and the same messages.

/// Keeps the order of the file, so that messages come in the order a reader meets their causes.
using Json = nlohmann::ordered_json;

/// Larger files are refused unread [bytes]: a configuration of this size is a mistake.
inline constexpr std::size_t kMaxConfigBytes = 16u << 20;

/// Deeper nesting is refused, so that no later recursion over the document can exhaust the stack.
inline constexpr std::size_t kMaxConfigDepth = 64;

/// Messages beyond this number are only counted: nobody reads more, and a file of nothing but
/// mistakes must not cost more than a sound one.
inline constexpr std::size_t kMostMessages = 100;

/// The whole text of a file. Throws ConfigError naming the file and the reason (missing, a folder,
/// not readable, larger than kMaxConfigBytes).
std::string ReadTextFile(const std::filesystem::path& path);

/// Parses RFC 8259 JSON in UTF-8; `file` is the name used in messages.
///
/// Throws ConfigError. "FILE:LINE:COLUMN: found ..., expected ..." for other encodings, syntax
/// errors, comments, trailing commas, NaN, Infinity and text after the document; "FILE:LINE:
/// /pointer: ..." for nesting deeper than kMaxConfigDepth and, all at once, for keys that occur
/// twice in one object (the parser would keep one of them without a word) and numbers that are not
/// zero but too small for a double. Linear in the size of the text.
Json ParseDocument(std::string_view text, const std::string& file);

/// Line of each value that one of `pointers` names, from 1; for a value of several lines the first.
/// Pointers that name nothing are left out. `text` is a document that ParseDocument accepts.
std::map<std::string, std::size_t> LinesOf(std::string_view text,
                                           const std::vector<std::string>& pointers);

/// `key` as one reference token of a JSON Pointer (RFC 6901): "~" and "/" escaped.
std::string PointerToken(std::string_view key);

/// A pointer as a message shows it: "(top level)" for "", and without the middle when it is long,
/// for keys have no limit of their own.
std::string ShownPointer(const std::string& pointer);

/// With control characters as JSON escapes them: names may hold any, and a message is one line.
std::string Printable(const std::string& text);

/// "" when the text is UTF-8 without a byte order mark and without zero bytes; else where, what was
/// found and what was expected, as "LINE:COLUMN: found ..., expected ...".
std::string EncodingFault(std::string_view text);

// What is wrong where the parser stopped, in the words of our other messages.
//
// Internal to harness/config.

/// "found ..., expected ... (hint)" from the parser's message about `text`. `position` is the
/// number of characters read, so that the offending token ends just before it.
std::string SyntaxMessage(const std::string& message, std::string_view text, std::size_t position);

/// The last letters of a token, which may be megabytes long.
std::string ShortToken(const std::string& token);

// Documents as people read them: schemas, and mechanisms and experiments that a command writes.

/// On one line, with a space behind each comma and colon.
std::string FlatText(const Json& value);

/// A whole file: what fits stands on one line, else one element per line, indented by two. Lines of
/// at most 100 characters where that is possible. Numbers are read back to the same bits.
std::string JsonText(const Json& document);

}  // namespace loopbench::harness
