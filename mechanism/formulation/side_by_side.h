// Runs that go on side by side in one thread, each on its own way, with a step length of its own.
// Where several wait for work of the same kind, it is done for all of them at once, in lanes
// (mechanism/algebra/lanes.h).
#pragma once

#include <memory>
#include <vector>

namespace loopbench {

/// What a solver does for several runs at once.
class Together {
 public:
  virtual ~Together() = default;
  /// All that its runs have asked for since it was done last. While runs are suspended nothing may
  /// be thrown.
  virtual void Do() noexcept = 0;
};

class SideBySide {
 public:
  virtual ~SideBySide() = default;

  /// Suspends the run that calls until every other one waits here, too, or has ended, and all
  /// `works` are done.
  virtual void Meet() = 0;

  /// What solvers of these runs have put there for the others to find.
  std::vector<std::unique_ptr<Together>> works;
};

}  // namespace loopbench
