#include "harness/isolation/print_from_child.h"

#include <sys/mman.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <stdexcept>

#include "harness/text/terminal.h"

namespace loopbench::harness {
namespace {

/// A file in memory that takes the child's standard output.
class Capture {
 public:
  Capture() : file_(::memfd_create("stdout", MFD_CLOEXEC)) {
    if (file_ < 0) {
      throw std::runtime_error(std::string("cannot make a file in memory: ") +
                               std::strerror(errno));
    }
  }
  Capture(const Capture&) = delete;
  Capture& operator=(const Capture&) = delete;
  ~Capture() { ::close(file_); }

  /// In the child. Line by line, so that what is said before it is killed is not lost.
  void TakeStandardOutput() const {
    ::dup2(file_, STDOUT_FILENO);
    ::setlinebuf(stdout);
  }

  /// In the parent, when the child has ended.
  void Print() const {
    std::array<char, 1 << 16> buffer;
    for (off_t at = 0;;) {
      const ssize_t count = ::pread(file_, buffer.data(), buffer.size(), at);
      if (count <= 0) return;
      PrintText({buffer.data(), static_cast<std::size_t>(count)});
      at += count;
    }
  }

 private:
  int file_;
};

}  // namespace

int PrintFromChild(const std::string& name, const ProcessLimits& limits,
                   const std::function<int()>& work) {
  const Capture capture;
  ProcessResult result;
  RunInProcesses(
      1, 1,
      [&](std::size_t) {
        capture.TakeStandardOutput();
        return std::to_string(FinishOutput(work()));
      },
      [&](std::size_t) { return limits; },
      [&](std::size_t, const ProcessResult& ended) { result = ended; });
  capture.Print();
  if (result.ending == ProcessEnding::kThrew) throw std::runtime_error(result.text);
  if (result.ending == ProcessEnding::kAnswered) return std::stoi(result.text);
  PrintError("{}: cut off ({}): {}\n", name, OutcomeOf(result.ending), result.text);
  return 2;
}

}  // namespace loopbench::harness
