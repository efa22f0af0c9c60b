// A model in the program of a peer. C++17, as harness/exchange/model.h.
#pragma once

#include <cstdint>
#include <stdexcept>

namespace loopbench::peers {

/// Error of a step that is rejected at every step size.
class StepTooSmall : public std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Counters of the program since Start().
struct Counts {
  std::int64_t steps = 0, rejected = 0, derivatives = 0, projections = 0;
};

/// Program made from an exchange::Model; coordinates q [num_q] and speeds u [num_u] in its order.
class Program {
 public:
  virtual ~Program() = default;

  /// Computes qdot = N(q) u and udot by the peer's equations.
  virtual void Derivative(const double* q, const double* u, double* qdot, double* udot) = 0;

  /// Starts from (q, u) at time 0; the last step ends at `t_end`.
  virtual void Start(const double* q, const double* u, double tolerance, double t_end) = 0;
  /// Takes one accepted, projected step. Throws StepTooSmall or errors of the program, which end
  /// the run.
  virtual void Step() = 0;
  virtual double time() const = 0;  ///< [s]
  virtual void State(double* q, double* u) const = 0;
  virtual Counts counts() const = 0;
};

}  // namespace loopbench::peers
