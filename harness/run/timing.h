// Times and counts: timed subjects, instructions, allocations, calibration.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "harness/base/record.h"
#include "harness/config/benchmarks.h"
#include "harness/config/experiment.h"
#include "mechanism/description/outcome.h"

namespace loopbench::harness {

// Counts the allocations of a program. Linked into benchmark programs only: it replaces malloc.

struct Allocations {
  std::int64_t count = 0;  ///< calls of malloc and its relatives so far
  std::int64_t bytes = 0;  ///< total requested so far; freed bytes are not subtracted
};

Allocations AllocationsSoFar();

/// Checks that an allocation is counted: throws std::runtime_error if another malloc has replaced
/// the counting one. Such a counter would always report zero.
void CheckAllocationsAreCounted();

// Calibration workload: measures the current speed of the machine by constant work.
//
// Another virtual machine may share the physical core, and a processor may lower its clock. Times
// then grow by a third. The calibration reveals it: its instructions are the same in every build.

/// Time [ns] of factoring a small matrix and of going through the first cache several times: the
/// work whose time shows a neighbour best (loops that stay in registers show 2 %). The least of
/// three, which take some 20 us together.
double CalibrationNs();

/// Returns the smallest result of CalibrationNs() in this process and before its fork: an estimate
/// for an otherwise idle machine. Infinite before the first call.
double CalibrationBaselineNs();

// Benchmarks: a right-hand side or an integrator step of one method of one mechanism, always from
// the same state. States are computed, not stored. Their hashes are saved (configs/benchmarks/),
// and a state that differs is rejected, because times of different states are not comparable.

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

/// Executed instructions in one file of Callgrind (valgrind --tool=callgrind): the first number of
/// its "totals:" line, counted as event "Ir". Throws std::runtime_error that names `file` when
/// there is no such line.
std::int64_t CallgrindInstructions(std::string_view text, const std::string& file);

// Times of right-hand sides and of whole simulations, in separate runs.
//
// The methods of one mechanism are measured in turn, batch by batch, so that speed changes of the
// machine affect all of them. The first one is timed a second time without a name; the difference
// (`aa_spread`, record.h) is the smallest significant one. `calibration_ns` and
// `calibration_wall_ns` are medians of the calibration between all rounds. Rounds on a slowed
// machine are measured again, for a second at most, and the quietest are kept. Right-hand sides of
// problems are evaluated at states of a run; families at their moving start.

/// Cases of one mechanism, timed against each other.
struct TimingGroup {
  std::string name;  ///< of the mechanism
  /// Makes the mechanism, in the process that times it: a member of a family may be very large.
  std::function<MechanismDescription()> describe;
  std::vector<Case> cases;  ///< with keys of kind "timing" and their ids
  bool simulate = true;     ///< whole simulations too; families have right-hand sides alone
};

/// Returns an experiment's timings that pass `filter`: a group per problem (with `timing.cases` per
/// problem and horizon), then one per member of a family. The experiment must outlive them.
std::vector<TimingGroup> TimingGroups(const Experiment& experiment, const Selection& filter = {});

inline constexpr double kBatchSeconds = 1e-3;  ///< long against the clock's resolution
inline constexpr int kBatches = 15;            ///< enough for a 10th and a 90th percentile

/// One record per case, in order. A case whose simulation fails keeps its row with outcome and,
/// where it got so far, its right-hand side's time. Right-hand sides are timed in `batches`.
std::vector<Record> TimeTogether(const Experiment& experiment, const TimingGroup& group,
                                 int batches = kBatches);

/// Number of records of all groups.
std::size_t CountTimings(const Experiment& experiment, const Selection& filter = {});

}  // namespace loopbench::harness
