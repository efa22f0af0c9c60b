// Recorder of a run: converts integrator states into trajectory rows of the user's mechanism.
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "harness/record/record.h"
#include "harness/reference/reference.h"
#include "harness/trajectory/columns.h"
#include "harness/trajectory/trajectory.h"
#include "mechanism/formulation/system.h"
#include "mechanism/loops/tree_dynamics.h"

namespace loopbench::harness {

/// Output file and options of a trajectory.
struct TrajectoryTask {
  const OutputOptions& output;
  std::filesystem::path path;
  std::string title;  ///< title of the case
};

/// Recorder for a mechanism that runs as one part; never used inside a right-hand side.
template <class Space>
class Recorder {
 public:
  /// `user`, `compiled`, `mechanism` and the references in `task` must outlive it.
  Recorder(const MechanismDescription& user, const Compiled& compiled,
           const Mechanism<Space, double>& mechanism, const TrajectoryTask& task);

  /// Writes a row for an integrator state at a step end or between steps. The state contains
  /// positions, speeds, and works if integrated. `lower` has a larger interpolation error, or is
  /// the same state.
  void TakeAt(double t, System<Space, double>& system, std::span<const double> y,
              std::span<const double> lower);
  /// Writes a row from the evaluated state of `system`; known accelerations are its udot(). `work`
  /// contains supplied and dissipated work; empty if not integrated.
  void Take(double t, const System<Space, double>& system, bool has_accelerations,
            std::span<const double> work);

  /// Completes the file and sets its record keys. Without recorded states the file has no rows.
  void Finish(Record& record);

 private:
  void Open();
  std::vector<std::string> Notes() const;

  const MechanismDescription& user_;
  const Compiled& compiled_;
  TrajectoryTask task_;
  TreeDynamics<Space, double> dynamics_;
  std::vector<Acceleration<Space, double>> A_;
  RunSample moment_;
  std::optional<std::vector<BodyMotion>> lower_;  ///< motions of the state with the larger error
  std::vector<double> ydot_;
  std::vector<MeasuredPoint> points_;  ///< points for comparing interpolation degrees
  double interpolation_ = 0.0;         ///< [m]
  std::unique_ptr<RowWriter> rows_;
  std::optional<TrajectoryWriter> file_;  ///< opened with the first row
  std::vector<double> row_;
};

}  // namespace loopbench::harness
