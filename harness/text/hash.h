// Hash function for short names of states, cases and versions.
#pragma once

#include <fmt/format.h>

#include <cstdint>
#include <string>
#include <string_view>

namespace loopbench::harness {

/// FNV-1a (64 bit) of bytes that come in parts. For finding equal data, not for security.
class FnvHash {
 public:
  void Add(std::string_view bytes) {
    for (const char byte : bytes) {
      hash_ = (hash_ ^ static_cast<unsigned char>(byte)) * 0x100000001b3u;
    }
  }
  /// Returns 16 hexadecimal digits.
  std::string Text() const { return fmt::format("{:016x}", hash_); }

 private:
  std::uint64_t hash_ = 0xcbf29ce484222325u;
};

inline std::string Fnv1a(std::string_view bytes) {
  FnvHash hash;
  hash.Add(bytes);
  return hash.Text();
}

}  // namespace loopbench::harness
