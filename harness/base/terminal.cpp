#include <fcntl.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>

#include "harness/base/text.h"

namespace loopbench::harness {
namespace {

Screen output_screen;  ///< as PrepareStreams() found it

std::string_view Variable(const char* name) {
  const char* value = std::getenv(name);
  return value == nullptr ? "" : value;
}

std::size_t WidthOf(int descriptor) {
  winsize size{};
  if (::ioctl(descriptor, TIOCGWINSZ, &size) == 0 && size.ws_col > 0) return size.ws_col;
  constexpr std::size_t kUsual = 80;
  const std::string_view columns = Variable("COLUMNS");
  std::size_t width = 0;
  std::from_chars(columns.data(), columns.data() + columns.size(), width);
  return width > 0 ? width : kUsual;
}

Screen ScreenOf(int descriptor) {
  if (::isatty(descriptor) != 1) return {};
  const std::string_view term = Variable("TERM");
  const bool colour = Variable("NO_COLOR").empty() && !term.empty() && term != "dumb";
  return {WidthOf(descriptor), colour, true};
}

int first_failure = 0;  ///< errno of the first failed write to standard output, or 0
bool output_is_file = false;

}  // namespace

Screen OutputScreen() { return output_screen; }

Screen ErrorScreen() { return ScreenOf(STDERR_FILENO); }

void ShowWide() { output_screen.width = 0; }

void PrepareStreams() {
  for (const int descriptor : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) {
    if (::fcntl(descriptor, F_GETFD) >= 0) continue;
    // the lowest free number is this one; read-only, so that writing fails as before
    if (::open("/dev/null", O_RDONLY) != descriptor) std::_Exit(2);
  }
  output_screen = ScreenOf(STDOUT_FILENO);
  std::signal(SIGPIPE, SIG_IGN);
  std::signal(SIGXFSZ, SIG_IGN);
}

void KeepOutputForFile() { output_is_file = true; }

void PrintMessage(std::string_view text) {
  output_is_file ? PrintErrorText(text) : PrintText(text);
}

void PrintText(std::string_view text) {
  errno = 0;
  const bool written = std::fwrite(text.data(), 1, text.size(), stdout) == text.size();
  if (!written && first_failure == 0) first_failure = errno;
}

void PrintErrorText(std::string_view text) {
  [[maybe_unused]] const std::size_t written = std::fwrite(text.data(), 1, text.size(), stderr);
}

int FinishOutput(int code) {
  errno = 0;
  if (std::fflush(stdout) != 0 && first_failure == 0) first_failure = errno;
  if (first_failure == 0 && std::ferror(stdout) == 0) return code;
  pollfd output = {STDOUT_FILENO, POLLOUT, 0};
  const bool reader_is_gone = ::poll(&output, 1, 0) > 0 && (output.revents & POLLERR) != 0;
  if (!reader_is_gone) {
    PrintError("cannot write to standard output{}{}\n", first_failure == 0 ? "" : ": ",
               first_failure == 0 ? "" : std::strerror(first_failure));
  }
  return code == 0 ? 2 : code;
}

}  // namespace loopbench::harness
