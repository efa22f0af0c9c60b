// Records the right-hand side of a formulation: the library's own text, evaluated once with a
// scalar that notes its operations (recorded.h).
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

/// A right-hand side. `options.general` is always taken as set.
struct RecordingSubject {
  const MechanismDescription& description;
  Coordinates coordinates = Coordinates::kJoint;
  std::string formulation = "odca";
  FormulationOptions options = {};
  bool with_work = false;  ///< System::IntegrateWork()
};

/// Time [s], positions and all speeds at which a system starts and chooses its mode.
struct RecordingStart {
  double t = 0.0;
  Eigen::VectorXd q, u;
};

/// Inputs of the graph: time, then the state.
struct RecordedDerivative {
  Graph graph;
  std::vector<int> outputs;         ///< nodes of dy/dt
  std::vector<double> numbers;      ///< dy/dt where it was recorded
  std::vector<int> carried_speeds;  ///< of the state, indices into u
};

/// Records dy/dt at time t and `state`: positions, then speeds, and works where these are wanted.
/// Throws NotCovered.
RecordedDerivative RecordDerivative(const RecordingSubject& subject, const RecordingStart& start,
                                    double t, const std::vector<double>& state);

/// Records next to the start: fixed amounts of up to 1e-6 are added to the time and the state. At
/// the start itself numbers may be zero or equal by chance, and rounding would decide which
/// operations follow.
RecordedDerivative RecordDerivative(const RecordingSubject& subject, const RecordingStart& start);

/// Exact counts of a right-hand side.
struct MethodCounts {
  OperationCounts as_run;    ///< operations of the text as it is
  OperationCounts result;    ///< what is left for dy/dt alone after simplification
  OperationCounts compared;  ///< including the operations for comparisons
  std::int64_t comparisons = 0;
  int depth = 0;  ///< operations on the longest path to dy/dt

  friend bool operator==(const MethodCounts&, const MethodCounts&) = default;
};
MethodCounts CountsOf(const RecordedDerivative& recorded);

}  // namespace loopbench::generate
