#include "harness/record/excerpt.h"

#include <fmt/format.h>

#include "harness/json/json_document.h"

namespace loopbench::harness {

std::string Excerpt(std::string_view text) {
  constexpr std::size_t kMost = 80;
  std::string_view beginning = text.substr(0, kMost);
  // whole characters only, where there are any
  for (std::size_t cut = 0; cut < 4 && beginning.size() < text.size(); ++cut) {
    if ((static_cast<unsigned char>(text[beginning.size()]) & 0xC0u) != 0x80u) break;
    beginning.remove_suffix(1);
  }
  if (EncodingFault(beginning).empty()) return Printable(std::string(beginning));
  std::string shown;
  for (const char c : beginning) {
    const auto byte = static_cast<unsigned char>(c);
    shown += byte >= 0x20 && byte < 0x7F ? std::string(1, c) : fmt::format("\\x{:02X}", byte);
  }
  return shown;
}

}  // namespace loopbench::harness
