// Other people's programs, started without a shell between.
#pragma once

#include <string>
#include <vector>

namespace loopbench::harness {

struct ProgramResult {
  int status = 0;  ///< exit status; 128 + the signal's number after a signal, as shells have it
  int error = 0;   ///< errno of a program that could not be started, else 0
  std::string output, messages;  ///< its standard output and standard error, whole

  /// Why it has nothing to give: "" when it ended with 0. `name` is how people know it.
  std::string Failure(const std::string& name) const;
};

/// Runs `words`, the program (sought in PATH) and its arguments, with `input` on its standard
/// input, and waits for it. Throws std::runtime_error only when no memory file can be made.
ProgramResult RunProgram(std::vector<std::string> words, const std::string& input = "");

/// Ends the program that RunProgram() waits for, if there is one. Async-signal-safe.
void EndProgram();

}  // namespace loopbench::harness
