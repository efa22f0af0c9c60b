// Times of a run: wall and CPU time of its own work, and a limit on the latter.
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

inline double WallSeconds() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

/// Time of the present thread that belongs to no run, or to other runs [s].
struct ForeignTime {
  double wall_s = 0.0, cpu_s = 0.0;  ///< in which code was recorded and compiled
  double others_s = 0.0;             ///< wall time of other runs, set when a run continues
};
inline thread_local ForeignTime foreign_time;

/// Adds the time of its life to `foreign_time` and its wall time to a sum [s].
class ForeignWork {
 public:
  explicit ForeignWork(double& sum_s) : sum_s_(sum_s) {}
  ~ForeignWork() {
    const double wall_s = WallSeconds() - wall_begin_;
    sum_s_ += wall_s;
    foreign_time.wall_s += wall_s;
    foreign_time.cpu_s += ThreadCpuSeconds() - cpu_begin_;
  }
  ForeignWork(const ForeignWork&) = delete;
  ForeignWork& operator=(const ForeignWork&) = delete;

 private:
  double& sum_s_;
  double wall_begin_ = WallSeconds(), cpu_begin_ = ThreadCpuSeconds();
};

/// CPU time limit of the run that creates and queries it.
///
/// Reading the CPU clock is a system call, ten times as expensive as reading the wall clock. CPU
/// time never exceeds wall time. The CPU clock is therefore read only after as much wall time as
/// was left at the last reading: hardly ever on an idle machine. Runs that take turns on one thread
/// read the wall clock at each turn, and share the CPU time in proportion.
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

  double wall_s() const { return AllRuns() - Others(); }
  double cpu_s() const {
    const double all = AllRuns(), cpu = ThreadCpuSeconds() - foreign_time.cpu_s - cpu_start_;
    return all > 0.0 ? cpu * (1.0 - Others() / all) : cpu;
  }

 private:
  double AllRuns() const { return WallSeconds() - foreign_time.wall_s - wall_start_; }
  double Others() const { return foreign_time.others_s - others_start_; }

  double limit_s_;
  double look_s_;  ///< wall time before which the limit cannot have been reached
  double wall_start_ = WallSeconds() - foreign_time.wall_s;
  double cpu_start_ = ThreadCpuSeconds() - foreign_time.cpu_s;
  double others_start_ = foreign_time.others_s;
};

}  // namespace loopbench::harness
