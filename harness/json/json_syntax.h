// What is wrong where the parser stopped, in the words of our other messages.
//
// Internal to harness/config.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace loopbench::harness {

/// "found ..., expected ... (hint)" from the parser's message about `text`. `position` is the
/// number of characters read, so that the offending token ends just before it.
std::string SyntaxMessage(const std::string& message, std::string_view text, std::size_t position);

/// The last letters of a token, which may be megabytes long.
std::string ShortToken(const std::string& token);

}  // namespace loopbench::harness
