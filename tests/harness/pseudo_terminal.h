// A program on a terminal of so many columns, as a person sees it: what it writes there, and keys
// that are pressed.
#pragma once

#include <poll.h>
#include <pty.h>
#include <sys/wait.h>
#include <unistd.h>

#include "tests/standard.h"

namespace loopbench::harness {

struct TerminalEnding {
  int code = -1;     ///< 128 + signal where that ended it
  std::string text;  ///< both streams, line ends as "\n"
};

/// Runs a line of the shell. `look` sees all that was written, ten times a second, and returns keys
/// to press, "" for none.
inline TerminalEnding OnTerminal(const std::string& line, int columns,
                                 const std::function<std::string(const std::string&)>& look = {}) {
  winsize size{
      .ws_row = 24, .ws_col = static_cast<unsigned short>(columns), .ws_xpixel = 0, .ws_ypixel = 0};
  int terminal = -1;
  TerminalEnding ending;
  const pid_t pid = ::forkpty(&terminal, nullptr, nullptr, &size);
  if (pid == 0) {
    ::setenv("TERM", "xterm", 1);
    ::unsetenv("NO_COLOR");
    ::execl("/bin/sh", "sh", "-c", line.c_str(), nullptr);
    ::_exit(127);
  }
  if (pid < 0) return ending;
  const auto begin = std::chrono::steady_clock::now();
  constexpr std::chrono::seconds kLongest(60);
  while (std::chrono::steady_clock::now() - begin < kLongest) {
    pollfd output = {terminal, POLLIN, 0};
    char buffer[4096];
    if (::poll(&output, 1, 100) > 0) {
      const ssize_t count = ::read(terminal, buffer, sizeof buffer);
      if (count <= 0) break;  // the last process has closed it
      for (const char c : std::string_view(buffer, static_cast<std::size_t>(count))) {
        // a carriage return before a line end is the terminal's own
        if (c == '\n' && ending.text.ends_with('\r')) ending.text.pop_back();
        ending.text += c;
      }
    }
    const std::string keys = look ? look(ending.text) : "";
    if (!keys.empty() && ::write(terminal, keys.data(), keys.size()) < 0) break;
  }
  ::close(terminal);
  int status = 0;
  ::waitpid(pid, &status, 0);
  ending.code = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  return ending;
}

}  // namespace loopbench::harness
