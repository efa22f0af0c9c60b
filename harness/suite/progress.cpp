#include "harness/suite/progress.h"

#include <unistd.h>

#include "harness/text/terminal.h"

namespace loopbench::harness {

namespace {

constexpr const char* kClear = "\r\033[K";  // the line that is there

}  // namespace

Progress::Progress(std::string what, std::size_t total)
    : what_(std::move(what)),
      total_(total),
      terminal_(isatty(STDERR_FILENO) != 0),
      begin_(std::chrono::steady_clock::now()) {}

Progress::~Progress() {
  if (terminal_) PrintErrorText(kClear);
}

void Progress::Step(const std::string& label) {
  const std::lock_guard lock(mutex_);
  ++done_;
  if (!terminal_) return;
  const std::chrono::duration<double> spent = std::chrono::steady_clock::now() - begin_;
  const double left =
      spent.count() * static_cast<double>(total_ - done_) / static_cast<double>(done_);
  PrintErrorText(kClear);
  PrintError("{} {}/{}  {:.0f} s gone, about {:.0f} s to go  {}", what_, done_, total_,
             spent.count(), left, label);
}

}  // namespace loopbench::harness
