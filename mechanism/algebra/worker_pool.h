// Threads that share the pieces of one piece of work, and wait for the next one.
//
// Workers spin for some microseconds after their work, which is longer than what lies between two
// rounds of one right-hand side, and then sleep. Which thread does which piece is fixed by their
// numbers alone, so pieces find in its cache what they left there. What is computed must not
// depend on it: pieces write to places of their own, and what they add up is added by the caller,
// in their order. A process that forks has no workers in its child: a pool is to be made where it
// is used.
#pragma once

#include <atomic>
#include <thread>
#include <vector>

namespace loopbench {

class WorkerPool {
 public:
  /// `threads` at work, the caller's among them: threads - 1 are started. Throws std::system_error
  /// where the system refuses one.
  explicit WorkerPool(int threads);
  ~WorkerPool();
  WorkerPool(const WorkerPool&) = delete;
  WorkerPool& operator=(const WorkerPool&) = delete;

  int threads() const { return static_cast<int>(workers_.size()) + 1; }

  /// do_piece(0) .. do_piece(pieces - 1), each once, neighbours on the same thread; returns when
  /// all are done. From one thread at a time; `do_piece` must not throw. Allocates nothing.
  template <class Work>
  void ForEach(int pieces, const Work& do_piece) {
    // one function for one thread and for many: what is compiled twice may round differently
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
  /// Begun so far; -1: all is over. What many look at has cache lines of its own.
  alignas(64) std::atomic<int> rounds_ = 0;
  alignas(64) std::atomic<int> at_work_ = 0;  ///< workers that have yet to do their share
};

}  // namespace loopbench
