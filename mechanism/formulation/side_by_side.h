// Batched runs in one thread, each with its own trajectory and step length. If several wait for
// work of the same kind, it is done for all of them at once, in lanes (mechanism/algebra/lanes.h).
#pragma once

#include <memory>
#include <vector>

namespace loopbench {

/// Work that a solver does for several runs at once.
class SharedWork {
 public:
  virtual ~SharedWork() = default;
  /// Does all work requested since the last call. Must not throw while runs are suspended.
  virtual void Do() noexcept = 0;
};

class SideBySide {
 public:
  virtual ~SideBySide() = default;

  /// Suspends the run that calls until every other one waits here, too, or has ended, and all
  /// `works` are done.
  virtual void Meet() = 0;

  /// Works shared by the solvers of these runs.
  std::vector<std::unique_ptr<SharedWork>> works;
};

}  // namespace loopbench
