// The standard streams of the programs. All that they print goes through here: text that cannot be
// written is an error with its reason, and never a signal or a line in somebody else's file.
#pragma once

#include <fmt/format.h>

#include <string_view>
#include <utility>

namespace loopbench::harness {

/// The first line of main(). Opens those of the descriptors 0, 1 and 2 that are closed: the next
/// file, a store for example, would get their numbers and with them all that is printed. What was
/// closed still cannot be written. Writing to a pipe without a reader, or beyond the limit of file
/// sizes, fails from now on instead of ending the process.
void PrepareStreams();

/// To standard output. What cannot be written is kept in mind for FinishOutput().
void PrintText(std::string_view text);

/// To standard error; without an effect where that cannot be written.
void PrintErrorText(std::string_view text);

template <typename... Values>
void Print(fmt::format_string<Values...> format, Values&&... values) {
  PrintText(fmt::format(format, std::forward<Values>(values)...));
}

template <typename... Values>
void PrintError(fmt::format_string<Values...> format, Values&&... values) {
  PrintErrorText(fmt::format(format, std::forward<Values>(values)...));
}

/// The exit code of a program that is done with `code`: 2 in place of 0 when something could not be
/// written to standard output, whoever wrote it. The reason is printed, unless the reader of a pipe
/// has gone, which `| head` does by design.
int FinishOutput(int code);

}  // namespace loopbench::harness
