// A right-hand side compiled ahead of time for one system (harness/generate/).
#pragma once

#include <cstdint>
#include <span>

namespace loopbench {

class CompiledDerivative {
 public:
  virtual ~CompiledDerivative() = default;

  /// Computes dy/dt as System::Examine() does, with the same bits. Returns false if (t, y) takes a
  /// branch that is not compiled; then `ydot` is unspecified and the system evaluates its own text.
  virtual bool Evaluate(double t, std::span<const double> y, std::span<double> ydot) = 0;

  /// Notes that the mode of the system has changed: earlier branches are no longer valid.
  virtual void ModeChanged() = 0;

  /// Evaluations that returned false.
  virtual std::int64_t misses() const = 0;
  /// Wall time [s] for recording and compiling.
  virtual double seconds() const = 0;
};

}  // namespace loopbench
