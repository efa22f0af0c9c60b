// Escaping of user texts for a terminal, a figure, a table or a file name, and their width.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace loopbench::harness {

// Escaping of names and other user texts for a terminal, a figure, a table or a file name.
//
// Files with such texts may come from any source. Every writer passes them through the function of
// its medium, so that they are shown and never act as instructions. Only JSON needs none: its
// writer (harness/record/record.h) keeps every character.

/// Returns the text with every active character shown, such as "\n", "\x1b" or "\u202e". Active
/// are control characters (also U+0080 to U+009F), marks of writing direction, line separators and
/// bytes that are not UTF-8. One line, deterministic. Used for terminals, and as the first step of
/// all functions below.
std::string EscapeTerminal(std::string_view text);

/// Escapes text of several lines for a terminal: line ends stay.
std::string EscapeTerminalLines(std::string_view text);

/// Escapes text within a line or cell of GitHub's Markdown: no markup, HTML, written link or
/// formula begins in it. Other characters stay unchanged, as in drift_position_max or "a <= b".
std::string EscapeMarkdown(std::string_view text);

/// Escapes a paragraph whose first characters must not make it a heading, list or quotation.
std::string EscapeMarkdownParagraph(std::string_view text);

/// Escapes all special characters of LaTeX text in a cell or a comment. Characters that pdflatex
/// lacks without further packages are written as "(U+6F22)"; it has the accented letters of
/// Latin-1.
std::string EscapeLatex(std::string_view text);

/// Escapes LaTeX text that is set in lines: a word may break after punctuation, and after eight
/// letters.
std::string BreakableLatex(std::string_view text);

/// Escapes text of SVG and HTML, in an element or an attribute: no character is markup, and control
/// characters are shown (escape.h).
std::string EscapeXml(std::string_view text);

/// Writes a CSV field, quoted if RFC 4180 (or a reader with "#" comments) needs it. A text that a
/// spreadsheet would read as a formula (it begins with =, +, - or @ and is no number) gets an
/// apostrophe in front, which spreadsheets hide. JSON contains such texts unchanged.
std::string EscapeCsv(std::string_view text);

/// Quotes a string for gnuplot; no character of it is special.
std::string QuoteGnuplot(std::string_view text);

/// Quotes the label of a tick, which gnuplot would read as a format.
std::string QuoteGnuplotTick(std::string_view text);

/// Returns a file name without extension for `name`: letters, digits, '.', '_', '+' and '-', at
/// most 200 of them, not beginning with '.' or '-'. A name of another form becomes a slug with a
/// hash of the whole name, so that two names never share a file.
std::string FileName(std::string_view name);

// Width of a text on a terminal. A letter takes one cell, a character of Chinese, Japanese or
// Korean two, a combining accent none.

/// Returns the cells of a UTF-8 text without control characters (EscapeTerminal), by the C
/// library's table. Unknown characters and invalid bytes count as one. Terminals agree except for
/// characters made of several, such as some emoji.
std::size_t CellsOf(std::string_view text);

/// Returns the longest beginning of at most `width` cells, and combining marks of its last letter.
std::string_view Beginning(std::string_view text, std::size_t width);

/// Breaks `text` into lines of at most `width` > 1 cells: after a comma if there is one, else at a
/// space. A longer word is broken too.
std::vector<std::string> BrokenInto(std::string_view text, std::size_t width);

}  // namespace loopbench::harness
