// The checksum at the end of a record's line.
#pragma once

#include <string>
#include <string_view>

namespace loopbench::harness {

/// `object`, a JSON object in one line, with its checksum as last key.
std::string WithChecksum(std::string object);

/// The error of a line that should have a checksum and has none.
inline constexpr const char* kWithoutChecksum =
    "found a line without its checksum, expected one: it may have been changed";

/// Whether the line ends with its checksum. Throws std::runtime_error naming the checksum found and
/// the one expected when it ends with another one, or with its own under a damaged name.
bool VerifyChecksum(std::string_view line);

}  // namespace loopbench::harness
