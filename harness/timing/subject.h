// Timed objects and the counter of their instructions.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>

#include "harness/config/benchmarks.h"
#include "mechanism/description/outcome.h"

namespace loopbench::harness {

// Work of one benchmark, ready to be repeated: a right-hand side or an integrator step of one
// method of one mechanism, always from the same state.
//
// States are computed, not stored: the mechanism's start, moved for a short time, so that speeds
// and all terms of the equations are nonzero. Their hashes are saved (configs/benchmarks/). A state
// that differs is rejected, because times of different states are not comparable.

/// Positions and speeds at which a mechanism is measured, the same for all methods of one
/// coordinate set.
struct BenchmarkState {
  Outcome outcome = Outcome::kFinished;
  std::string message;  ///< why there is no state
  Eigen::VectorXd q, u;
  std::string hash;  ///< of q and u, rounded (HashRounded)
};

/// The start of the description after 0.05 s of O-DCA at velocity level, in fixed steps.
BenchmarkState ComputeState(const MechanismDescription& description, Coordinates coordinates);

/// Returns FNV-1a (64 bit) of the numbers rounded to 1e-6. Other flags and libraries change states
/// by about 1e-13, so hashes agree except with a chance of 1e-7 per number.
std::string HashRounded(std::span<const double> numbers);

/// FNV-1a (64 bit) of all bits.
std::string HashExact(std::span<const double> numbers);

class BenchmarkSubject {
 public:
  virtual ~BenchmarkSubject() = default;
  /// Evaluates the right-hand side at the state.
  virtual Outcome Derivative() = 0;
  /// One step of the set's integrator and length, from the state.
  virtual Outcome Step() = 0;
  /// dy/dt of the last Derivative().
  virtual std::span<const double> derivative() const = 0;
  virtual int bodies() const = 0;
  virtual int rank() const = 0;  ///< at the state
  /// Multiplications and additions of a right-hand side as O-DCA counts them; -1 for the others.
  virtual std::int64_t operations() const = 0;
};

/// Throws std::invalid_argument when the mechanism cannot be made or the method cannot start.
std::unique_ptr<BenchmarkSubject> MakeSubject(const MechanismDescription& description,
                                              const Method& method, const BenchmarkState& state,
                                              const std::string& integrator, double step);

// Instruction counts from the files of Callgrind (valgrind --tool=callgrind).

/// Executed instructions in one file of Callgrind: the first number of its "totals:" line, counted
/// as event "Ir". Throws std::runtime_error that names `file` when there is no such line.
std::int64_t CallgrindInstructions(std::string_view text, const std::string& file);

}  // namespace loopbench::harness
