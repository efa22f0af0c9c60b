#include "harness/json/json_syntax.h"

#include <fmt/format.h>

#include <algorithm>

namespace loopbench::harness {
namespace {

bool IsWordCharacter(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '+' ||
         c == '-' || c == '.' || c == '_';
}

/// The number or bare word that was read last, or the last character when there is none.
std::string_view LastWord(std::string_view text, std::size_t position) {
  if (position == 0 || text.empty()) return "";
  std::size_t begin = std::min(position, text.size()) - 1;
  if (!IsWordCharacter(text[begin]) && begin > 0 && IsWordCharacter(text[begin - 1])) --begin;
  std::size_t end = begin + 1;
  if (!IsWordCharacter(text[begin])) {
    while (end < text.size() && (static_cast<unsigned char>(text[end]) & 0xC0u) == 0x80u) ++end;
    return text.substr(begin, end - begin);  // a whole character, of several bytes perhaps
  }
  while (begin > 0 && IsWordCharacter(text[begin - 1])) --begin;
  while (end < text.size() && IsWordCharacter(text[end])) ++end;
  return text.substr(begin, end - begin);
}

/// What the characters around a syntax error suggest, as " (...)" or "".
std::string Hint(std::string_view text, std::size_t position, std::string_view word) {
  if (position == 0 || position > text.size() || word.empty()) return "";
  std::size_t at = position - 1;
  const char offending = text[at];
  if (offending == '/' || offending == '#') return " (comments are not allowed)";
  if (offending == '\'') return " (strings stand in double quotes)";
  const std::string_view number = word.substr(word[0] == '-' || word[0] == '+' ? 1 : 0);
  if (number.starts_with("NaN") || number.starts_with("nan") || number.starts_with("Inf") ||
      number.starts_with("inf")) {
    return " (NaN and Infinity are not allowed)";
  }
  if (word[0] == '+') return " (numbers have no leading +)";
  if (number.starts_with('.')) return " (numbers have a digit before the point)";
  if (number.starts_with("0x") || number.starts_with("0X")) return " (numbers are decimal)";
  const bool after_zero =
      number.size() > 1 && number[0] == '0' && number[1] >= '0' && number[1] <= '9';
  if (after_zero) return " (numbers have no leading zeros)";
  if (word == "True" || word == "False") return " (true and false are written small)";
  if (word == "None") return " (no value is written null, or left out)";
  if (offending != ']' && offending != '}') return "";
  while (at > 0 && (text[at - 1] == ' ' || text[at - 1] == '\t' || text[at - 1] == '\n' ||
                    text[at - 1] == '\r')) {
    --at;
  }
  const bool trailing_comma = at > 0 && text[at - 1] == ',';
  return trailing_comma ? " (remove the comma before the closing bracket)" : "";
}

/// What follows `start` in the message, up to `end` or to its end; "" without it.
std::string Between(const std::string& message, std::string_view start, std::string_view end) {
  const std::size_t at = message.find(start);
  if (at == std::string::npos) return "";
  const std::size_t from = at + start.size();
  const std::size_t to = end.empty() ? std::string::npos : message.find(end, from);
  return message.substr(from, to == std::string::npos ? to : to - from);
}

/// In words for people: the parser knows no "," where it expects a closing bracket.
std::string Expected(const std::string& parsers, bool in_key) {
  if (parsers == "'}'") return "',' or '}'";
  if (parsers == "']'") return "',' or ']'";
  if (parsers == "end of input") return "the end of the file";
  if (parsers.starts_with("digit")) return "a digit" + parsers.substr(5);
  if (in_key || parsers == "string literal") return "a key in double quotes";
  return parsers.starts_with("'[', '{'") || parsers.empty() ? "a value" : parsers;
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

// The message reads "... while parsing WHAT - FOUND; expected EXPECTED; last read: 'TOKEN'"; only
// FOUND is always there, the others come in any order. TOKEN may be megabytes.
std::string SyntaxMessage(const std::string& message, std::string_view text, std::size_t position) {
  const bool in_key = message.find("parsing object key") != std::string::npos;
  std::string found = Between(message, " - ", "; last read");
  if (const std::size_t at = found.find("; expected "); at != std::string::npos) found.erase(at);
  if (found.starts_with("invalid string: ")) {
    return fmt::format("found an invalid string ({}), expected one as JSON writes it",
                       found.substr(16));
  }
  std::string tail = message.substr(std::min(message.size(), message.find(" - ")));
  const std::size_t last = tail.rfind("; expected ");
  const std::string expected = Expected(
      last == std::string::npos ? "" : Between(tail.substr(last), "; expected ", "; last read"),
      in_key);
  const std::string_view word = LastWord(text, position);
  if (found.starts_with("unexpected ")) found.erase(0, 11);
  if (found == "end of input") {
    found = "the end of the file";
  } else if (found == "string literal") {
    found = "a string";
  } else if (found == "invalid literal" || found == "number literal" || found == "invalid number" ||
             found.ends_with(" literal")) {
    const bool letters = !word.empty() && IsWordCharacter(word.front());
    found = letters ? ShortToken(std::string(word)) : fmt::format("'{}'", word);
  }
  return fmt::format("found {}, expected {}{}", found, expected, Hint(text, position, word));
}

}  // namespace loopbench::harness
