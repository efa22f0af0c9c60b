// Records the right-hand side of a formulation, evaluated with a recording scalar (recorded.h).
#pragma once

#include <stdexcept>
#include <string>
#include <vector>

#include "harness/generate/graph.h"
#include "mechanism/description/description.h"
#include "mechanism/description/topology.h"
#include "mechanism/formulation/options.h"

namespace loopbench::generate {

/// A right-hand side that cannot be recorded, with the reason.
class NotCovered : public std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Results that can be recorded, in the order of a recording's outputs.
enum class Quantity {
  kDerivative,  ///< dy/dt
  kEnergy,      ///< kinetic and potential energy [J]
  /// Poses of all bodies except Ground: centre of mass [m] in ground axes, then in the plane cosine
  /// and sine of the angle, in space the rotation matrix by rows.
  kPoses,
  kViolation,   ///< of each constraint row: of positions [m, rad], then of speeds [m/s, rad/s]
  kCorrection,  ///< the state after one Newton step toward the constraints, positions then speeds
  // Steps of level projection (compiled_derivative.h), where constraints are regular.
  kMismatch,
  kPositionStep,
  kSpeedStep,
};

/// A formulation of a mechanism. `options.general` is always taken as set.
struct RecordingSubject {
  MechanismDescription description;
  Coordinates coordinates = Coordinates::kJoint;
  std::string formulation = "odca";
  FormulationOptions options = {};
  bool with_work = false;      ///< System::IntegrateWork()
  bool keeps_numbers = false;  ///< in the graph (graph.h)
  Quantity quantity = Quantity::kDerivative;
  /// Longest recording, in nodes. Equations of shipped mechanisms have some ten thousand.
  std::size_t most_nodes = 100'000;
  /// Runs side by side call code together if its recording has at least this many live nodes. A
  /// change of runs takes some 150 ns, more than lanes save in shorter code
  /// (results/methods/README.md).
  std::int64_t least_in_lanes = 2000;
  /// Equal for runs of one mechanism, which share recordings; null: no other run has it.
  const void* mechanism = nullptr;
};

/// Time [s], positions and all speeds at which a system starts and chooses its mode.
struct RecordingStart {
  double t = 0.0;
  Eigen::VectorXd q, u;
  /// Choices of its solver before (ConstraintSolver::AppendMode()); empty: it chooses here.
  std::vector<int> mode = {};
  std::vector<double> whole_turns = {};  ///< of angles of cut joints (Kinematics)
};

/// Nodes of intermediate results on the way to dy/dt. A stage depends on earlier ones.
struct Stages {
  std::vector<int> positions;  ///< poses of bodies, joint points and directions
  std::vector<int> speeds;     ///< all speeds, which a level may compute from the state's
  std::vector<int> motions;    ///< velocities, and accelerations without udot
  std::vector<int> forces;     ///< applied forces
};

/// Inputs of the graph: time, then the state.
struct RecordedFunction {
  Graph graph;
  std::vector<int> inputs, outputs;  ///< nodes
  std::vector<double> numbers;       ///< the recorded values of the outputs
  std::vector<int> carried_speeds;   ///< of the state, indices into u
  bool is_regularized = false;       ///< the solver regularized constraints for dy/dt
  Stages stages;                     ///< of dy/dt alone
  std::string structure;             ///< Graph::Structure() of the outputs
  std::string key;                   ///< functions of a mechanism with equal keys are equal
};

/// Records the quantity at t and `state`: positions, speeds, works if wanted. Throws NotCovered.
RecordedFunction RecordFunction(const RecordingSubject& subject, const RecordingStart& start,
                                double t, const std::vector<double>& state);

/// Records next to the start: fixed amounts of up to 1e-6 are added to the time and the state. At
/// the start itself numbers may be zero or equal by chance, and rounding would decide which
/// operations follow.
RecordedFunction RecordFunction(const RecordingSubject& subject, const RecordingStart& start);

/// The amount that is added to number i of (state, time).
double ShiftOf(std::size_t i);

/// Throws NotCovered if a compiler would take too long: 24 000 operations take 3.5 s,
/// factorisations that iterate have hundreds of thousands.
void RequireShort(const RecordedFunction& recorded);

/// Nodes on which outputs or comparisons depend: inputs, constants and operations.
std::int64_t LiveNodes(const RecordedFunction& recorded);

/// Exact counts of a right-hand side.
struct MethodCounts {
  OperationCounts as_run;    ///< operations without simplification
  OperationCounts result;    ///< operations for dy/dt alone after simplification
  OperationCounts compared;  ///< including the operations for comparisons
  std::int64_t comparisons = 0;
  /// Parts of `result`: poses and motions; applied forces; equations of motion and constraints.
  OperationCounts kinematics, forces, solve;
  int depth = 0;        ///< operations on the longest path to dy/dt
  int solve_depth = 0;  ///< the same behind kinematics and forces

  friend bool operator==(const MethodCounts&, const MethodCounts&) = default;
};
MethodCounts CountsOf(const RecordedFunction& recorded);

// A graph as C99 (print_c.cpp): straight-line functions of some hundred operations each, which pass
// values on through an array. The time to compile a function grows faster than its length.

/// Functions that printed text calls; to be printed once before it.
extern const char* const kPrintedHelpers;

/// A static function
///
///   int NAME(const double* x, double* y, double* w)
///
/// x holds the inputs, y receives the outputs, and w has room for *room numbers. It returns 0 if a
/// comparison comes out otherwise than it was recorded; y is unspecified then. It calls
/// `sines(angle, &sine, &cosine)` for the angle of a planar pose, which must be defined before.
/// The text depends on the graph alone.
std::string PrintFunction(const RecordedFunction& recorded, const std::string& name, int* room);

/// PrintFunction() as a translation unit for CompileBranch() (generated.h), which defines
///
///   void loopbench_use_sines(void (*sines)(double, double*, double*))   to be called first
///   int loopbench_function(const double* x, const double* c, double* y, double* w)
///   const int loopbench_room
///
/// c holds ConstantsOf() the function. The text contains no number, so mechanisms with other masses
/// or lengths share it.
/// With `own_sines`, the function that loopbench_use_sines() receives computes all sines.
std::string PrintLibrary(const RecordedFunction& recorded, bool own_sines = false);
/// Values of Graph::Given().
std::vector<double> ConstantsOf(const RecordedFunction& recorded);

/// Prints the same function for `lanes` states at once, in vector types of GCC and clang:
///
///   void loopbench_use_lane_sines(void (*sines)(const double*, double*, double*))
///
/// receives sines and cosines of as many angles. x, c, y and w are arrays of vectors: the numbers
/// of a quantity in all lanes follow each other. Bit i of the result is set if all comparisons come
/// out as recorded in lane i. Without fused multiply-add, lanes have PrintLibrary()'s bits.
std::string PrintLanes(const RecordedFunction& recorded, int lanes, bool own_sines = false);

}  // namespace loopbench::generate
