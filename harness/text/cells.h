// How much room a text takes on a terminal. One cell holds a letter; a character of Chinese,
// Japanese or Korean takes two, an accent that combines with the letter before it takes none.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace loopbench::harness {

/// Cells of a text in UTF-8 without control characters (EscapeTerminal), by the C library's table.
/// Characters that it does not know, and bytes that are none, count as one. Terminals agree but for
/// characters made of several, such as some emoji.
std::size_t CellsOf(std::string_view text);

/// The longest beginning of at most `width` cells, with the marks that belong to its last letter.
std::string_view Beginning(std::string_view text, std::size_t width);

/// `text` in lines of at most `width` > 1 cells, broken behind a comma where there is one, else at
/// a space; a word longer than that is broken too.
std::vector<std::string> BrokenInto(std::string_view text, std::size_t width);

}  // namespace loopbench::harness
