// EncodingFault: text in other encodings than UTF-8, called by its name.
#include <fmt/format.h>

#include <algorithm>

#include "harness/json/json_document.h"

namespace loopbench::harness {
namespace {

constexpr std::string_view kExpected = "expected UTF-8 text";

/// A byte order mark or the zero bytes of wide characters at the start, or "".
std::string_view WideEncoding(std::string_view text) {
  using namespace std::string_view_literals;
  // the longer marks first: that of UTF-32 begins like that of UTF-16
  if (text.starts_with("\xFF\xFE\0\0"sv) || text.starts_with("\0\0\xFE\xFF"sv)) return "UTF-32";
  if (text.starts_with("\xFF\xFE"sv) || text.starts_with("\xFE\xFF"sv)) return "UTF-16";
  if (text.size() < 2 || (text[0] == '\0') == (text[1] == '\0')) return "";
  return text.size() >= 4 && text[1] == '\0' && text[2] == '\0' ? "UTF-32" : "UTF-16";
}

/// Bytes of the UTF-8 character at the start of `text`, or 0 when there is none.
std::size_t CharacterLength(std::string_view text) {
  const auto byte = [text](std::size_t i) { return static_cast<unsigned char>(text[i]); };
  const unsigned first = byte(0);
  if (first < 0x80) return 1;
  std::size_t length = 0;
  if (first >= 0xC2 && first <= 0xDF) length = 2;
  if (first >= 0xE0 && first <= 0xEF) length = 3;
  if (first >= 0xF0 && first <= 0xF4) length = 4;
  if (length == 0 || text.size() < length) return 0;
  for (std::size_t i = 1; i < length; ++i) {
    if ((byte(i) & 0xC0u) != 0x80u) return 0;
  }
  // overlong forms, surrogates, beyond U+10FFFF
  const unsigned second = byte(1);
  const bool refused = (first == 0xE0 && second < 0xA0) || (first == 0xED && second > 0x9F) ||
                       (first == 0xF0 && second < 0x90) || (first == 0xF4 && second > 0x8F);
  return refused ? 0 : length;
}

/// "LINE:COLUMN" of the byte at `position`; columns count bytes, as in the messages of compilers.
std::string PlaceOf(std::string_view text, std::size_t position) {
  const std::string_view before = text.substr(0, position);
  const auto line = std::count(before.begin(), before.end(), '\n') + 1;
  const std::size_t start = before.rfind('\n');
  return fmt::format("{}:{}", line,
                     start == std::string_view::npos ? position + 1 : position - start);
}

}  // namespace

std::string EncodingFault(std::string_view text) {
  if (text.starts_with("\xEF\xBB\xBF")) {
    return fmt::format("1:1: found a UTF-8 byte order mark (EF BB BF), {} without one", kExpected);
  }
  if (const std::string_view wide = WideEncoding(text); !wide.empty()) {
    return fmt::format("1:1: found {} text, {}", wide, kExpected);
  }
  for (std::size_t i = 0; i < text.size();) {
    if (text[i] == '\0') {
      return fmt::format("{}: found a zero byte, {}", PlaceOf(text, i), kExpected);
    }
    const std::size_t length = CharacterLength(text.substr(i, 4));
    if (length > 0) {
      i += length;
      continue;
    }
    const auto byte = static_cast<unsigned char>(text[i]);
    // Latin-1 has letters from C0 on; below are Windows' quotes and dashes
    return fmt::format("{}: found the byte {:02X}, which is not UTF-8 (it may be {}), {}",
                       PlaceOf(text, i), byte, byte >= 0xA0 ? "Latin-1" : "Windows-1252",
                       kExpected);
  }
  return "";
}

}  // namespace loopbench::harness
