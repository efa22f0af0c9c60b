// External programs, files in memory, and the end of a process without memory.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace loopbench::harness {

// File in memory for the output of a child process; it is readable however the child ends.

/// File without a name that disappears however this process ends. Programs started by exec do not
/// inherit it, children made by fork do.
class MemoryFile {
 public:
  /// @param what  purpose of the file, for messages
  explicit MemoryFile(const char* what);
  ~MemoryFile();
  MemoryFile(const MemoryFile&) = delete;
  MemoryFile& operator=(const MemoryFile&) = delete;

  int descriptor() const { return descriptor_; }

  /// Returns all written text, independent of the file position.
  std::string Text() const;

 private:
  int descriptor_;
};

// External programs, started without a shell.

struct ProgramResult {
  int status = 0;  ///< exit status; 128 + the signal number after a signal, as in shells
  int error = 0;   ///< errno if the program could not be started, else 0
  std::string output, messages;  ///< complete standard output and standard error

  /// Returns the reason of a failure, "" for exit status 0. `name` is the program's usual name.
  std::string Failure(const std::string& name) const;
};

/// Runs `words`, the program (searched in PATH) and its arguments, with `input` on its standard
/// input, and waits for it. The program receives SIGTERM if this process ends before. Throws
/// std::runtime_error only if no memory file can be made.
ProgramResult RunProgram(std::vector<std::string> words, const std::string& input = "");

/// Ends the program for which RunProgram() waits, if there is one. Async-signal-safe.
void EndProgram();

// Handling of memory exhaustion in code from which no exception may leave: destructors (JSON
// documents allocate there), noexcept library functions, threads.

/// Makes such a process exit with `code` after `message` on standard error, instead of SIGABRT.
/// Other uncaught errors end it as before. `message` must stay valid.
void ExitWithoutMemory(int code, std::string_view message);

}  // namespace loopbench::harness
