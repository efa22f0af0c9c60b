#include "harness/config/json_syntax.h"

#include <fmt/format.h>

namespace loopbench::harness {
namespace {

/// What the characters around a syntax error suggest, as " (...)" or "".
std::string Hint(std::string_view text, std::size_t position) {
  if (position == 0 || position > text.size()) return "";
  std::size_t at = position - 1;
  const char offending = text[at];
  if (offending == '/' || offending == '#') return " (comments are not allowed)";
  const bool not_a_number = offending == 'N' || offending == 'I' || offending == 'i';
  if (not_a_number) return " (NaN and Infinity are not allowed)";
  if (offending == '\'') return " (strings stand in double quotes)";
  if (offending == '+') return " (numbers have no leading +)";
  if (offending == '.') return " (numbers have a digit before the point)";
  const bool after_zero = offending >= '0' && offending <= '9' && at > 0 && text[at - 1] == '0';
  if (after_zero) return " (numbers have no leading zeros)";
  if (offending == 'T' || offending == 'F') return " (true and false are written small)";
  if (offending != ']' && offending != '}') return "";
  while (at > 0 && (text[at - 1] == ' ' || text[at - 1] == '\t' || text[at - 1] == '\n' ||
                    text[at - 1] == '\r')) {
    --at;
  }
  const bool trailing_comma = at > 0 && text[at - 1] == ',';
  return trailing_comma ? " (remove the comma before the closing bracket)" : "";
}

void Replace(std::string* text, std::string_view from, std::string_view to) {
  const std::size_t at = text->find(from);
  if (at != std::string::npos) text->replace(at, from.size(), to);
}

}  // namespace

std::string ShortToken(const std::string& token) {
  constexpr std::size_t kLongest = 40;
  if (token.size() <= kLongest) return token;
  std::size_t start = token.size() - kLongest;
  while (start < token.size() && (static_cast<unsigned char>(token[start]) & 0xC0u) == 0x80u) {
    ++start;
  }
  return "..." + token.substr(start);
}

// The parser's message reads "... while parsing WHAT - FOUND; expected EXPECTED;
// last read: 'TOKEN'", where only FOUND is always there.
std::string SyntaxMessage(std::string message, std::string_view text, std::size_t position) {
  const bool in_key = message.find("parsing object key") != std::string::npos;
  if (const std::size_t dash = message.find(" - "); dash != std::string::npos) {
    message.erase(0, dash + 3);
  }
  std::string expected = in_key ? "a key in double quotes" : "a value", token;
  if (const std::size_t at = message.find("; last read: "); at != std::string::npos) {
    token = " " + ShortToken(message.substr(at + 13));
    message.erase(at);
  }
  if (const std::size_t at = message.find("; expected "); at != std::string::npos) {
    expected = message.substr(at + 11);
    message.erase(at);
  }
  Replace(&message, "unexpected ", "");
  Replace(&message, "end of input", "the end of the file");
  Replace(&expected, "end of input", "the end of the file");
  Replace(&expected, "'[', '{', or a literal", "a value");
  Replace(&expected, "string literal", "a key in double quotes");
  return fmt::format("found {}{}, expected {}{}", message, token, expected, Hint(text, position));
}

}  // namespace loopbench::harness
