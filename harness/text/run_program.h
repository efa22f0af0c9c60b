// Processes: programs of others, files in memory, the end without memory.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace loopbench::harness {

// A file in memory: what a child process prints is read from it, whatever becomes of the child.

/// It has no name, and nothing of it is left however this process ends. Programs started by
/// exec do not inherit it, children made by fork do.
class MemoryFile {
 public:
  /// @param what  it is for, in messages
  explicit MemoryFile(const char* what);
  ~MemoryFile();
  MemoryFile(const MemoryFile&) = delete;
  MemoryFile& operator=(const MemoryFile&) = delete;

  int descriptor() const { return descriptor_; }

  /// All that was written, wherever the file's position stands.
  std::string Text() const;

 private:
  int descriptor_;
};

// Other people's programs, started without a shell between.

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

// The end of a process whose memory runs out where no exception may leave: in a destructor (JSON
// documents allocate there), in a noexcept function of a library, in a thread.

/// From now on such a process exits with `code` after `message` on standard error, instead of
/// SIGABRT. Other errors that nothing catches end it as before. `message` must last.
void ExitWithoutMemory(int code, std::string_view message);

}  // namespace loopbench::harness
