// Writes the trajectory of a run: what the integrator shows becomes rows of the user's mechanism.
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

/// Where and why a trajectory is written.
struct TrajectoryTask {
  const OutputOptions& output;
  std::filesystem::path path;
  std::string title;  ///< which case it is of
};

/// Of a mechanism that runs as one part. None of its functions is called in a right-hand side.
template <class Space>
class Recorder {
 public:
  /// `user`, `compiled`, `mechanism` and what the task refers to outlive it.
  Recorder(const MechanismDescription& user, const Compiled& compiled,
           const Mechanism<Space, double>& mechanism, const TrajectoryTask& task);

  /// A row at a time between steps, or at the end of one, of the integrator's state: positions,
  /// speeds, and where they are integrated the works. `lower` has more of the interpolation's error
  /// in it; it may be the same state.
  void TakeAt(double t, System<Space, double>& system, std::span<const double> y,
              std::span<const double> lower);
  /// A row of what `system` has examined: its accelerations, if they are known, are its udot().
  /// `work` is what has been supplied and dissipated; empty where that is not integrated.
  void Take(double t, const System<Space, double>& system, bool has_accelerations,
            std::span<const double> work);

  /// The file and its keys. Where nothing was taken the file has no rows.
  void Finish(Record& record);

 private:
  void Open();
  std::vector<std::string> Notes() const;

  const MechanismDescription& user_;
  const Compiled& compiled_;
  TrajectoryTask task_;
  TreeDynamics<Space, double> dynamics_;
  std::vector<Acceleration<Space, double>> A_;
  MomentOfRun moment_;
  std::optional<std::vector<BodyMotion>> lower_;  ///< of the state with more error
  std::vector<double> ydot_;
  std::vector<MeasuredPoint> points_;  ///< at which degrees are compared
  double interpolation_ = 0.0;         ///< [m]
  std::unique_ptr<RowWriter> rows_;
  std::optional<TrajectoryWriter> file_;  ///< opened with the first row
  std::vector<double> row_;
};

}  // namespace loopbench::harness
