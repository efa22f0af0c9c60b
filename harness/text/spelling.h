// The nearest valid spelling of a mistyped word, for error messages.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace loopbench::harness {

/// Number of single-letter insertions, deletions, replacements and swaps of neighbours that turn
/// one word into the other (restricted Damerau-Levenshtein distance).
int EditDistance(std::string_view a, std::string_view b);

/// The word of `known` nearest to `given`, upper and lower case taken as the same, or "" when none
/// is near enough to be what was meant: more than a third of the letters of `given` (at least
/// one), or all letters of the word, would have to change, and neither is the start of the other.
/// The first of equally near words wins.
std::string NearestSpelling(std::string_view given, const std::vector<std::string>& known);

}  // namespace loopbench::harness
