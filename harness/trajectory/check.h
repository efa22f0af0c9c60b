// Checks of trajectories against the equations and against each other.
#pragma once

#include <string>
#include <vector>

#include "harness/trajectory/trajectory.h"
#include "harness/trajectory/user_mechanism.h"

namespace loopbench::harness {

// Checks a trajectory of any program against a mechanism: constraint violation, energy, and
// consistency of speeds with positions.

/// Largest value of a quantity and its time.
struct LargestAt {
  double value = 0.0, t = 0.0;
  bool is_known = false;

  /// Adds a value; the first NaN stays.
  void Add(double other, double time) {
    if (is_known && (other <= value || value != value)) return;
    value = other, t = time, is_known = true;
  }
};

struct JointCheck {
  std::string joint;
  LargestAt shift = {}, rotation = {};             ///< constraint violation [m], [rad]
  LargestAt velocity = {}, angular_velocity = {};  ///< [m/s], [rad/s]
  LargestAt coordinates = {};  ///< given coordinates minus those from body poses [rad], [m]
};

struct SpeedCheck {
  std::string label;  ///< label of the speed
  LargestAt apart;    ///< difference from the positions, in its unit
};

struct TrajectoryCheck {
  std::int64_t rows = 0;
  double from = 0.0, to = 0.0;  ///< [s]
  std::string source;           ///< "body poses" or "joint coordinates"
  bool has_speeds = false;
  std::vector<JointCheck> joints;  ///< joints of the mechanism, then couplings
  LargestAt shift, rotation;       ///< largest of all joints
  LargestAt energy;                ///< change of kinetic + potential - supplied + dissipated [J]
  double kinetic = 0.0;            ///< largest [J]
  std::string no_energy;           ///< reason why the energy is unknown; or empty
  /// Mean speed over two steps by the parabola through three speeds (Simpson's rule), minus the
  /// difference of positions. They differ by (h^4 / 90) times the fourth derivative of the speed.
  std::vector<SpeedCheck> speeds;
  std::vector<std::string> unknown;  ///< labels that do not exist in the mechanism
};

/// Checks row by row, with fixed memory. Throws as TrajectoryReader, and
/// std::runtime_error for missing columns, no rows or a row with a non-finite number in a motion
/// column.
TrajectoryCheck CheckTrajectory(const std::filesystem::path& path,
                                const MechanismDescription& user);

// Comparison of two trajectories of one mechanism.

/// A column of both trajectories.
struct SharedColumn {
  std::string label, unit;
  std::size_t in_ours = 0, in_theirs = 0;
};

/// Returns the columns with equal labels, except the time, in the order of `ours`.
std::vector<SharedColumn> SharedColumns(const Trajectory& ours, const Trajectory& theirs);

/// Returns the value of `ours` at a time: of that row, or of the cubic through the four rows around
/// it. NaN outside. `is_between` (may be null): true if the time is no row's.
double ValueAt(const Trajectory& ours, std::size_t column, double t, bool* is_between = nullptr);

/// Returns `theirs` minus `ours` at the times of `theirs`, angles modulo full turns; NaN outside
/// `ours`.
std::vector<double> Differences(const Trajectory& ours, const Trajectory& theirs,
                                const SharedColumn& column);

}  // namespace loopbench::harness
