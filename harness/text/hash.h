// The hash of this harness: short names for states, cases and versions.
#pragma once

#include <fmt/format.h>

#include <cstdint>
#include <string>
#include <string_view>

namespace loopbench::harness {

/// FNV-1a (64 bit) of the bytes, as 16 hexadecimal digits. For finding equals, not for security.
inline std::string Fnv1a(std::string_view bytes) {
  std::uint64_t hash = 0xcbf29ce484222325u;
  for (const char byte : bytes) {
    hash = (hash ^ static_cast<unsigned char>(byte)) * 0x100000001b3u;
  }
  return fmt::format("{:016x}", hash);
}

}  // namespace loopbench::harness
