// A model in a peer's own program. C++17, as harness/exchange/model.h.
#pragma once

#include <cstdint>
#include <stdexcept>

namespace loopbench::peers {

/// Thrown by a step that was not accepted however short it became.
class StepTooSmall : public std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// What the program counted since Start().
struct Counts {
  std::int64_t steps = 0, rejected = 0, derivatives = 0, projections = 0;
};

/// Made from an exchange::Model, by whose order coordinates q [num_q] and speeds u [num_u] are.
class Program {
 public:
  virtual ~Program() = default;

  /// N(q) u and udot by the peer's equations.
  virtual void Derivative(const double* q, const double* u, double* qdot, double* udot) = 0;

  /// From (q, u) at time 0 with steps that end at `t_end`.
  virtual void Start(const double* q, const double* u, double tolerance, double t_end) = 0;
  /// One accepted step, projected. May throw StepTooSmall, or whatever the program throws: then the
  /// run is over.
  virtual void Step() = 0;
  virtual double time() const = 0;  ///< [s]
  virtual void State(double* q, double* u) const = 0;
  virtual Counts counts() const = 0;
};

}  // namespace loopbench::peers
