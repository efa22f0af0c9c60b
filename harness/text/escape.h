// Texts of users on their way into a terminal, a figure, a table or a file's name, and their room.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace loopbench::harness {

// Names and other texts of users on their way into a terminal, a figure, a table or a file's name.
//
// Texts come from files that may have been written by anybody. Every writer passes them through the
// function of its medium, so that what is drawn or printed is the text and never an instruction.
// JSON is the exception: its writer (harness/record/record.h) keeps every character.

/// The text with every character shown that would else act: control characters (also U+0080 to
/// U+009F), marks of writing direction, line separators and bytes that are no UTF-8 become "\n",
/// "\t", "\x1b" or "\u202e". One line, the same for the same text. Terminals, and the first step of
/// all below.
std::string EscapeTerminal(std::string_view text);

/// The same for text of several lines: line ends stay.
std::string EscapeTerminalLines(std::string_view text);

/// Text within a line or cell of Markdown (GitHub's): no markup, HTML, written link or formula
/// begins in it. Characters that cannot begin any stay as they are, as in drift_position_max or "a
/// <= b".
std::string EscapeMarkdown(std::string_view text);

/// A paragraph of its own, whose first characters must not make it a heading, list or quotation.
std::string EscapeMarkdownParagraph(std::string_view text);

/// Text of LaTeX, as a cell or in a comment: all special characters escaped. Characters that
/// pdflatex does not have without further packages are written as "(U+6F22)"; of accented letters
/// it has those of Latin-1.
std::string EscapeLatex(std::string_view text);

/// The same for text that is set in lines: a word may end behind punctuation, and after eight
/// letters.
std::string BreakableLatex(std::string_view text);

/// Text of SVG and HTML, in an element or an attribute: no character of it is markup, and control
/// characters are shown (escape.h).
std::string EscapeXml(std::string_view text);

/// A field of CSV, quoted where RFC 4180 (or a reader that takes "#" for a comment) needs it. A
/// text that a spreadsheet would take for a formula (it begins with =, +, - or @ and is no number)
/// gets an apostrophe before it, which spreadsheets hide; JSON has such texts as they are.
std::string EscapeCsv(std::string_view text);

/// A string of gnuplot with its quotation marks; no character of it is special.
std::string QuoteGnuplot(std::string_view text);

/// The same for the label of a tick, which gnuplot would take for a format.
std::string QuoteGnuplotTick(std::string_view text);

/// The name of a file, without extension, for a thing called `name`: letters, digits, '.', '_',
/// '+' and '-', at most 200 of them, not beginning with '.' or '-'. A name that is not one already
/// becomes a slug with a hash of the whole name, so that two names never share a file.
std::string FileName(std::string_view name);

// How much room a text takes on a terminal. One cell holds a letter; a character of Chinese,
// Japanese or Korean takes two, an accent that combines with the letter before it takes none.

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
