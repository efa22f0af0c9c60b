// Pieces of stores in messages.
#pragma once

#include <string>
#include <string_view>

namespace loopbench::harness {

/// The beginning of `text`, whatever it holds, in valid UTF-8 and without control characters: at
/// most some 80 bytes, other bytes as \xNN.
std::string Excerpt(std::string_view text);

}  // namespace loopbench::harness
