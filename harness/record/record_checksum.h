// The checksum at the end of a record's line.
#pragma once

#include <string>
#include <string_view>

namespace loopbench::harness {

/// `object`, a JSON object in one line, with its checksum as last key.
std::string WithChecksum(std::string object);

/// Throws std::runtime_error naming the checksum found and the one expected when `line` has one
/// that is not its own, or its own under a damaged name.
void VerifyChecksum(std::string_view line);

}  // namespace loopbench::harness
