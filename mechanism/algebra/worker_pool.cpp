#include "mechanism/algebra/worker_pool.h"

#include <cstdint>

namespace loopbench {

namespace {

constexpr int kOver = -1;
/// Number of polls of an atomic before a thread sleeps, about 20 to 60 us with pauses: rounds of
/// one evaluation follow within a few, and waking takes as long.
constexpr int kLooks = 1000;

void Pause() {
#if defined(__x86_64__)
  __builtin_ia32_pause();
#endif
}

/// The value, once it is not `known` any more.
int WaitForChange(const std::atomic<int>& value, int known) {
  for (int look = 0; look < kLooks; ++look) {
    const int now = value.load(std::memory_order_acquire);
    if (now != known) return now;
    Pause();
  }
  value.wait(known, std::memory_order_acquire);
  return value.load(std::memory_order_acquire);
}

}  // namespace

WorkerPool::WorkerPool(int threads) {
  try {
    for (int thread = 1; thread < threads; ++thread) {
      workers_.emplace_back([this, thread] { Run(thread); });
    }
  } catch (...) {
    End();
    throw;
  }
}

WorkerPool::~WorkerPool() { End(); }

void WorkerPool::End() {
  rounds_.store(kOver);
  rounds_.notify_all();
  for (std::thread& worker : workers_) worker.join();
}

void WorkerPool::Do(int thread) const {
  const auto first = [&](int t) {
    return static_cast<int>(std::int64_t{round_.pieces} * t / threads());
  };
  round_.range(round_.work, first(thread), first(thread + 1));
}

void WorkerPool::Share(const Round& round) {
  round_ = round;
  at_work_.store(static_cast<int>(workers_.size()), std::memory_order_relaxed);
  // in one order with notify_all's look at who sleeps: else both could miss the other
  rounds_.store((rounds_.load(std::memory_order_relaxed) + 1) & 0x3fffffff);
  rounds_.notify_all();
  Do(0);
  for (int left = at_work_.load(std::memory_order_acquire); left != 0;) {
    left = WaitForChange(at_work_, left);
  }
}

void WorkerPool::Run(int thread) {
  int known = 0;
  while ((known = WaitForChange(rounds_, known)) != kOver) {
    Do(thread);
    if (at_work_.fetch_sub(1, std::memory_order_acq_rel) == 1) at_work_.notify_one();
  }
}

}  // namespace loopbench
