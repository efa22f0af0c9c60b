// Standard output and error, and the properties of their terminals.
#pragma once

#include <fmt/format.h>

#include <cstddef>
#include <string_view>
#include <type_traits>
#include <utility>

#include "harness/text/escape.h"

namespace loopbench::harness {

// Width and colour of standard output and standard error (docs/decisions/024).

struct Screen {
  std::size_t width = 0;  ///< [cells]; 0: unlimited, for files and pipes
  bool colour = false;
  bool is_terminal = false;
};

/// Returns the screen of standard output as PrepareStreams() found it; child processes that print
/// into memory have it, too. If a terminal reports no width, it is the environment variable
/// COLUMNS, else 80. Colour is on if the terminal supports it, unless disabled as in
/// https://no-color.org.
Screen OutputScreen();

/// Returns the screen of standard error, which shows progress if it is a terminal (width > 0).
Screen ErrorScreen();

/// Makes the width of standard output unlimited: --wide.
void ShowWide();

// Standard streams of the programs. All output goes through here: text that cannot be written gives
// an error with its reason, and never a signal or a line in an unrelated file.

/// Opens closed descriptors among 0, 1 and 2; call it first in main(). Otherwise the next file, for
/// example a store, would get their numbers and all printed text. Closed streams still cannot be
/// written. From now on, writing to a pipe without reader or beyond the file size limit fails
/// instead of ending the process.
void PrepareStreams();

/// Writes every byte unchanged to standard output: tables, which are escaped and may have colours,
/// and machine formats. FinishOutput() reports a failed write.
void PrintText(std::string_view text);

/// From now on, Print() writes to standard error: a file of the command is standard output.
void KeepOutputForFile();

/// Writes a text for people to standard output, or to standard error after KeepOutputForFile().
void PrintMessage(std::string_view text);

/// Writes to standard error; does nothing if that cannot be written.
void PrintErrorText(std::string_view text);

/// Text of several lines among the values of Print(): its line ends stay.
struct Lines {
  std::string_view text;
};

namespace internal {

/// Returns a value for printing: texts are escaped, other values unchanged.
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

/// Formats values. Texts within a range pass only the second escape, which keeps line ends.
template <typename... Values>
std::string Formatted(fmt::format_string<PrintedAs<Values>...> format, const Values&... values) {
  return EscapeTerminalLines(fmt::format(format, Printed(values)...));
}

}  // namespace internal

/// Prints for people: texts among the values, from any source, are shown and never act on the
/// terminal (EscapeTerminal).
template <typename... Values>
void Print(fmt::format_string<internal::PrintedAs<Values>...> format, const Values&... values) {
  PrintMessage(internal::Formatted<Values...>(format, values...));
}

template <typename... Values>
void PrintError(fmt::format_string<internal::PrintedAs<Values>...> format,
                const Values&... values) {
  PrintErrorText(internal::Formatted<Values...>(format, values...));
}

/// Returns the exit code of a program that ends with `code`: 2 instead of 0 if any text could not
/// be written to standard output. Prints the reason, unless the reader of a pipe has closed it, as
/// `| head` does by design.
int FinishOutput(int code);

}  // namespace loopbench::harness
