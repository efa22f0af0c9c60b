// Threads that share the pieces of a task and wait for the next task.
//
// Workers spin for some microseconds after their work, longer than the time between two rounds of
// one right-hand side, and then sleep. Numbers alone assign pieces to threads, so pieces find their
// data in the cache. Results must not depend on the assignment: each piece has its own output, and
// the caller adds sums up in order. After a fork the child has no workers: create a pool in the
// process that uses it.
#pragma once

#include <atomic>
#include <thread>
#include <vector>

namespace loopbench {

class WorkerPool {
 public:
  /// Starts threads - 1 workers; the caller is one of the `threads`. Throws std::system_error if
  /// the system cannot start one.
  explicit WorkerPool(int threads);
  ~WorkerPool();
  WorkerPool(const WorkerPool&) = delete;
  WorkerPool& operator=(const WorkerPool&) = delete;

  int threads() const { return static_cast<int>(workers_.size()) + 1; }

  /// do_piece(0) .. do_piece(pieces - 1), each once, neighbours on the same thread; returns when
  /// all are done. From one thread at a time; `do_piece` must not throw. Allocates nothing.
  template <class Work>
  void ForEach(int pieces, const Work& do_piece) {
    // one function for any number of threads: two compiled versions may round differently
    const auto range = [](const void* work, int first, int last) {
      for (int i = first; i < last; ++i) (*static_cast<const Work*>(work))(i);
    };
    if (workers_.empty() || pieces < 2) return range(&do_piece, 0, pieces);
    Share({range, &do_piece, pieces});
  }

 private:
  struct Round {
    void (*range)(const void* work, int first, int last) = nullptr;
    const void* work = nullptr;
    int pieces = 0;
  };
  void Share(const Round& round);
  void End();
  /// The pieces of one thread.
  void Do(int thread) const;
  void Run(int thread);

  std::vector<std::thread> workers_;
  Round round_;  ///< written before rounds_ grows, read after
  /// Rounds begun so far; -1: finished. Shared by many threads, hence on its own cache lines.
  alignas(64) std::atomic<int> rounds_ = 0;
  alignas(64) std::atomic<int> at_work_ = 0;  ///< workers that have yet to do their share
};

}  // namespace loopbench
