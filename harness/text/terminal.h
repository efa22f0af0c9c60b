// Standard output and error, and what their reader sees.
#pragma once

#include <fmt/format.h>

#include <cstddef>
#include <string_view>
#include <type_traits>
#include <utility>

#include "harness/text/escape.h"

namespace loopbench::harness {

// What whoever reads standard output or standard error sees: the one place that decides width and
// colour (docs/decisions/024).

bool OutputIsTerminal();

struct Screen {
  std::size_t width = 0;  ///< [cells]; 0: as wide as it takes, for files and pipes
  bool colour = false;
};

/// Of standard output. A terminal that does not know its width has that of the environment's
/// COLUMNS, else 80. There is colour on a terminal that has it, unless https://no-color.org is
/// obeyed.
Screen OutputScreen();

/// Of standard error: where progress is shown, if it is a terminal (width > 0).
Screen ErrorScreen();

/// From now on standard output is as wide as it takes: --wide.
void ShowWide();

// The standard streams of the programs. All that they print goes through here: text that cannot be
// written is an error with its reason, and never a signal or a line in somebody else's file.

/// The first line of main(). Opens those of the descriptors 0, 1 and 2 that are closed: the next
/// file, a store for example, would get their numbers and with them all that is printed. What was
/// closed still cannot be written. Writing to a pipe without a reader, or beyond the limit of file
/// sizes, fails from now on instead of ending the process.
void PrepareStreams();

/// To standard output, every byte as it is: tables, which are escaped and may have colours, and
/// formats for machines. What cannot be written is kept in mind for FinishOutput().
void PrintText(std::string_view text);

/// To standard error; without an effect where that cannot be written.
void PrintErrorText(std::string_view text);

/// A text of several lines among the values of Print(): its line ends stay.
struct Lines {
  std::string_view text;
};

namespace internal {

/// What becomes of a value: a text is escaped, all else goes as it is.
template <typename Value>
auto Printed(const Value& value) {
  if constexpr (std::is_same_v<Value, Lines>) {
    return EscapeTerminalLines(value.text);
  } else if constexpr (std::is_convertible_v<const Value&, std::string_view>) {
    return EscapeTerminal(value);
  } else {
    return value;
  }
}

template <typename Value>
using PrintedAs = decltype(Printed(std::declval<const std::remove_cvref_t<Value>&>()));

/// Texts within a range of values pass the second sieve only, which lets line ends through.
template <typename... Values>
std::string Formatted(fmt::format_string<PrintedAs<Values>...> format, const Values&... values) {
  return EscapeTerminalLines(fmt::format(format, Printed(values)...));
}

}  // namespace internal

/// For people: texts among the values, whoever wrote them, are shown and never act on the terminal
/// (EscapeTerminal).
template <typename... Values>
void Print(fmt::format_string<internal::PrintedAs<Values>...> format, const Values&... values) {
  PrintText(internal::Formatted<Values...>(format, values...));
}

template <typename... Values>
void PrintError(fmt::format_string<internal::PrintedAs<Values>...> format,
                const Values&... values) {
  PrintErrorText(internal::Formatted<Values...>(format, values...));
}

/// The exit code of a program that is done with `code`: 2 in place of 0 when something could not be
/// written to standard output, whoever wrote it. The reason is printed, unless the reader of a pipe
/// has gone, which `| head` does by design.
int FinishOutput(int code);

}  // namespace loopbench::harness
