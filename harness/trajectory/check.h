// Trajectories held against the equations, and against each other.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "harness/trajectory/trajectory.h"
#include "harness/trajectory/user_mechanism.h"

namespace loopbench::harness {

// Holds a trajectory, of whatever program, against a mechanism: are its constraints kept, its
// energy, and do its speeds belong to its positions?

/// The largest of some number, and when.
struct LargestAt {
  double value = 0.0, t = 0.0;
  bool is_known = false;

  /// The first that is no number stays.
  void Add(double other, double time) {
    if (is_known && (other <= value || value != value)) return;
    value = other, t = time, is_known = true;
  }
};

struct JointCheck {
  std::string joint;
  LargestAt shift = {}, rotation = {};             ///< of what it constrains [m], [rad]
  LargestAt velocity = {}, angular_velocity = {};  ///< [m/s], [rad/s]
  LargestAt coordinates =
      {};  ///< given coordinates from those that the bodies' poses have [rad], [m]
};

struct SpeedCheck {
  std::string label;  ///< of the speed
  LargestAt apart;    ///< from what the positions say, in its unit
};

struct TrajectoryCheck {
  std::int64_t rows = 0;
  double from = 0.0, to = 0.0;  ///< [s]
  std::string source;           ///< "body poses" or "joint coordinates"
  bool has_speeds = false;
  std::vector<JointCheck> joints;  ///< of the mechanism, but free ones
  LargestAt shift, rotation;       ///< of all
  LargestAt energy;                ///< change of kinetic + potential - supplied + dissipated [J]
  double kinetic = 0.0;            ///< largest [J]
  std::string no_energy;           ///< why there is none; or empty
  /// The mean speed of two steps by the parabola through three speeds (Simpson's rule), against the
  /// difference of positions: they differ by (h^4 / 90) times the fourth derivative of the speed.
  std::vector<SpeedCheck> speeds;
  std::vector<std::string> unknown;  ///< labels that the mechanism has not
};

/// Where every body is, row by row: from the poses of all bodies, or from the coordinates of joints
/// that lead to each of them (`explain` lists which close loops); speeds where all of them are
/// there.
class MotionReader {
 public:
  /// Throws std::runtime_error that names the columns that are missing for either.
  MotionReader(const MechanismDescription& user, const std::vector<TrajectoryColumn>& columns,
               const std::string& file);
  ~MotionReader();

  bool from_joints() const;
  bool has_speeds() const;
  /// By the user's body, at rest where there are no speeds.
  const std::vector<BodyMotion>& Read(double t, const std::vector<double>& row);

 private:
  struct Work;
  std::unique_ptr<Work> work_;
};

/// Row by row, in memory of a fixed size. Throws as TrajectoryReader and MotionReader do, and
/// std::runtime_error for no row, or one without a finite number in a column of the motion.
TrajectoryCheck CheckTrajectory(const std::filesystem::path& path,
                                const MechanismDescription& user);

// Two trajectories of one mechanism beside each other.

/// A column that both have.
struct SharedColumn {
  std::string label, unit;
  std::size_t in_ours = 0, in_theirs = 0;
};

/// Columns with the same label, but for the time, in our order.
std::vector<SharedColumn> SharedColumns(const Trajectory& ours, const Trajectory& theirs);

/// Ours at a time, by the cubic through the four rows around it, or the row itself where it has
/// that time; NaN outside.
double ValueAt(const Trajectory& ours, std::size_t column, double t);

/// Theirs minus ours at their times, angles without whole turns; NaN where ours has none.
std::vector<double> Differences(const Trajectory& ours, const Trajectory& theirs,
                                const SharedColumn& column);

}  // namespace loopbench::harness
