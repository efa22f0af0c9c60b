// Words in messages: characters of UTF-8, lists, counts, the nearest spelling of a mistyped word.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace loopbench::harness {

/// True if a byte of UTF-8 continues the character before it.
inline bool ContinuesCharacter(char byte) {
  return (static_cast<unsigned char>(byte) & 0xC0u) == 0x80u;
}

std::size_t CountCharacters(std::string_view text);

/// Returns the first `most` bytes, without a partial character, and "..." if more follows.
std::string Abbreviated(const std::string& text, std::size_t most = 60);

/// Returns "a, b and c", or a list with another last word.
std::string ListInWords(const std::vector<std::string>& words, std::string_view last = "and");

/// Returns "A", "B", ..., "Z", "A1", ...: a short name of the index-th of many things.
std::string LetterOf(std::size_t index);

/// Returns "1 run", "2 runs", "2 bodies".
std::string WithCount(std::size_t count, const std::string& word);

/// Returns the number of single-letter insertions, deletions, replacements and swaps of neighbours
/// that turn one word into the other (restricted Damerau-Levenshtein distance).
int EditDistance(std::string_view a, std::string_view b);

/// Returns the word of `known` nearest to `given`, ignoring case, or "" if none is near enough. A
/// word is near if one is the start of the other. Otherwise the changes may not exceed a third of
/// the letters of `given` (at least one), and must be fewer than the letters of the word. The first
/// of equally near words wins.
std::string NearestSpelling(std::string_view given, const std::vector<std::string>& known);

}  // namespace loopbench::harness
