// A right-hand side compiled ahead of time for one system (harness/generate/), and the steps of
// level projection.
#pragma once

#include <cstdint>
#include <span>

namespace loopbench {

/// Functions of level projection at positions and speeds (level.cpp).
enum class ProjectionStep {
  kMismatch,   ///< largest violations of rotations [rad] and of points [m]
  kPositions,  ///< positions after one Newton step
  kSpeeds,     ///< speeds after their step
};

class CompiledDerivative {
 public:
  virtual ~CompiledDerivative() = default;

  /// Computes dy/dt as System::Examine() does, with the same bits. Returns false if (t, y) takes a
  /// branch that is not compiled; then `ydot` is unspecified and the system evaluates its own text.
  virtual bool Evaluate(double t, std::span<const double> y, std::span<double> ydot) = 0;

  /// Returns true if the last Evaluate() that returned true regularized constraints.
  virtual bool is_regularized() const = 0;

  /// Writes d(dy/dt)/dy of the first `jacobian.size() / y.size()` numbers of y, column after
  /// column. Returns false as Evaluate() does, and if it cannot be compiled.
  virtual bool Jacobian(double t, std::span<const double> y, std::span<double> jacobian) = 0;

  /// Writes the results of a step at time t, `q` and all speeds `u`, as the library computes them
  /// where constraints are regular. Returns false as Evaluate() does.
  virtual bool Project(ProjectionStep step, double t, std::span<const double> q,
                       std::span<const double> u, std::span<double> results) = 0;

  /// Notes an accepted step, after which the mode of the system may be another.
  virtual void StepAccepted() = 0;

  /// Calls that returned false.
  virtual std::int64_t misses() const = 0;
  /// Wall time [s] for recording and compiling.
  virtual double seconds() const = 0;
};

}  // namespace loopbench
