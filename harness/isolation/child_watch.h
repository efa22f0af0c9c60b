// What a child process does with its time, seen from its parent.
//
// Wall time says nothing about a piece of work: sixty-four pieces on two processors take
// thirty-two times as long, and a machine that sleeps for a night takes a night. So a child is
// judged by two clocks that other work does not move:
//   - its CPU time, which the kernel counts;
//   - how long it has been asleep of its own accord. Work that computes has no reason to sleep: it
//     reads nothing, waits for nobody, and its answer is taken from it as it comes.
// Asleep is what the kernel calls so (state S). A child that is ready to run but gets no processor
// (R), is stopped or traced (T, t) or waits for a disk or for swapped memory (D) is held up by the
// machine; that time counts neither for nor against it. Since the parent may be stopped too, one
// look adds no more than the time that should lie between two looks, however long it was.
#pragma once

#include <sys/types.h>

#include <chrono>

namespace loopbench::harness {

/// Time between two looks at a child [s].
inline constexpr double kLook_s = 0.25;

class ChildWatch {
 public:
  /// `pid` is a child that has not been waited for.
  explicit ChildWatch(pid_t pid) : pid_(pid) {}

  /// Looks at the child, unless the last look is less than kLook_s ago. `unread`: its answer waits
  /// to be read, which is not its fault.
  void Look(bool unread);

  /// CPU time used so far, all threads [s].
  double cpu_s() const;
  /// Time asleep on end, as far as looks have found, since it last computed [s].
  double idle_s() const { return idle_s_; }

 private:
  using Clock = std::chrono::steady_clock;

  pid_t pid_;
  Clock::time_point looked_ = Clock::now();
  double cpu_before_ = 0.0;  ///< at the last look
  double idle_s_ = 0.0;
};

}  // namespace loopbench::harness
