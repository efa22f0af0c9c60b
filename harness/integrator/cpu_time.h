// CPU time of the calling thread, and a limit on it.
//
// Limits measure the case, not the machine: waiting for a processor or being stopped uses wall
// time, but no CPU time.
#pragma once

#include <chrono>
#include <ctime>

namespace loopbench::harness {

/// CPU time that the calling thread has used since it began [s].
inline double ThreadCpuSeconds() {
  std::timespec time{};
  ::clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

/// CPU time limit of the thread that creates and queries it.
///
/// Reading the CPU clock is a system call, ten times as expensive as reading the wall clock. CPU
/// time never exceeds wall time. The CPU clock is therefore read only after as much wall time as
/// was left at the last reading: hardly ever on an idle machine.
class CpuLimit {
 public:
  explicit CpuLimit(double limit_s) : limit_s_(limit_s), look_s_(limit_s) {}

  bool Reached() {
    const double wall = wall_s();
    if (wall < look_s_) return false;
    const double left = limit_s_ - cpu_s();
    look_s_ = wall + left;
    return left <= 0.0;
  }

  double wall_s() const {
    return std::chrono::duration<double>(Clock::now() - wall_start_).count();
  }
  double cpu_s() const { return ThreadCpuSeconds() - cpu_start_; }

 private:
  using Clock = std::chrono::steady_clock;
  double limit_s_;
  double look_s_;  ///< wall time before which the limit cannot have been reached
  Clock::time_point wall_start_ = Clock::now();
  double cpu_start_ = ThreadCpuSeconds();
};

}  // namespace loopbench::harness
