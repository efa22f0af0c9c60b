#include "harness/text/screen.h"

#include <sys/ioctl.h>
#include <unistd.h>

#include <charconv>
#include <cstdlib>
#include <string_view>

namespace loopbench::harness {
namespace {

bool is_wide = false;

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
  return {WidthOf(descriptor), colour};
}

}  // namespace

bool OutputIsTerminal() { return ::isatty(STDOUT_FILENO) == 1; }

Screen OutputScreen() {
  Screen screen = ScreenOf(STDOUT_FILENO);
  if (is_wide) screen.width = 0;
  return screen;
}

Screen ErrorScreen() { return ScreenOf(STDERR_FILENO); }

void ShowWide() { is_wide = true; }

}  // namespace loopbench::harness
