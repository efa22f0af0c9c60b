// Words in messages: characters of UTF-8, lists, counts, the nearest spelling of a mistyped word.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace loopbench::harness {

/// Whether a byte of UTF-8 goes on with the character before it.
inline bool ContinuesCharacter(char byte) {
  return (static_cast<unsigned char>(byte) & 0xC0u) == 0x80u;
}

std::size_t CountCharacters(std::string_view text);

/// The first `most` bytes, without a part of a character, and "..." where more follows.
std::string Abbreviated(const std::string& text, std::size_t most = 60);

/// "a, b and c", or another last word.
std::string ListInWords(const std::vector<std::string>& words, std::string_view last = "and");

/// "1 run", "2 runs".
std::string WithCount(std::size_t count, const std::string& word);

/// Number of single-letter insertions, deletions, replacements and swaps of neighbours that turn
/// one word into the other (restricted Damerau-Levenshtein distance).
int EditDistance(std::string_view a, std::string_view b);

/// The word of `known` nearest to `given`, upper and lower case taken as the same, or "" when none
/// is near enough to be what was meant: more than a third of the letters of `given` (at least
/// one), or all letters of the word, would have to change, and neither is the start of the other.
/// The first of equally near words wins.
std::string NearestSpelling(std::string_view given, const std::vector<std::string>& known);

}  // namespace loopbench::harness
