#include "harness/isolation/child_watch.h"

#include <fmt/format.h>

#include <algorithm>
#include <ctime>
#include <fstream>
#include <string>

namespace loopbench::harness {
namespace {

/// R, S, D, T, .. of /proc/PID/stat; '?' where there is none.
char StateOf(pid_t pid) {
  std::ifstream file(fmt::format("/proc/{}/stat", pid));
  std::string line;
  std::getline(file, line);
  // "pid (name) state ..": the name may hold anything, parentheses too
  const std::size_t name_end = line.rfind(") ");
  return name_end == std::string::npos || name_end + 2 >= line.size() ? '?' : line[name_end + 2];
}

}  // namespace

double ChildWatch::cpu_s() const {
  clockid_t clock{};
  std::timespec time{};
  if (::clock_getcpuclockid(pid_, &clock) != 0 || ::clock_gettime(clock, &time) != 0) return 0.0;
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

void ChildWatch::Look(bool unread) {
  const Clock::time_point now = Clock::now();
  const double since = std::chrono::duration<double>(now - looked_).count();
  if (since < kLook_s) return;
  constexpr double kComputes = 0.01;  // of the time: one that naps between glances does not
  const double used = cpu_s();
  const bool computed = used - cpu_before_ > kComputes * since;
  if (computed || unread) {
    idle_s_ = 0.0;
  } else if (StateOf(pid_) == 'S') {
    idle_s_ += std::min(since, kLook_s);
  }
  looked_ = now;
  cpu_before_ = used;
}

}  // namespace loopbench::harness
