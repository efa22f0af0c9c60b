// Columns of a trajectory: names, units, and a row of values.
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "harness/config/experiment.h"
#include "harness/trajectory/user_mechanism.h"

namespace loopbench::harness {

// Columns of a trajectory: names, units and order.
//
//   t [s]
//   joint:NAME:COORDINATE [rad|m|1]      then its speeds: "angle speed [rad/s]", "wx [rad/s]"
//   body:NAME:x [m] y z, angle [rad] or qw [1] qx qy qz, vx [m/s] vy vz, w [rad/s] or wx wy wz
//   point:BODY:POINT:x [m] y z, vx [m/s] vy vz
//   reaction:JOINT:fx [N] fy fz, mx [N m] my mz
//   drive:JOINT:COORDINATE [N m|N]
//   force:INDEX:KIND:JOINT:effort [N m|N], force:INDEX:KIND:tension [N], force:INDEX:KIND:fx [N]
//   ... energy:kinetic [J] potential, supplied, dissipated
//
// Planar trajectories omit z, qw, mx etc. In names a backslash precedes ':' and '\', and control
// characters are made visible: labels are unique and have one line. CSV quotes the rest.

struct TrajectoryColumn {
  std::string kind;       ///< "joint", "body", ...; "t"
  std::string name;       ///< name of the part, as written between the colons; may be empty
  std::string component;  ///< "angle", "x", ...
  std::string unit;

  /// Returns "joint:A:angle [rad]".
  std::string Label() const;
  friend bool operator==(const TrajectoryColumn&, const TrajectoryColumn&) = default;
};

/// Returns a name as written in labels.
std::string LabelName(std::string_view name);

/// Parses a label; returns nothing if it is invalid.
std::optional<TrajectoryColumn> ParseLabel(std::string_view label);

/// Returns all columns of a mechanism, "t [s]" first.
std::vector<TrajectoryColumn> TrajectoryColumns(const MechanismDescription& user,
                                                const OutputOptions& output);

/// Return the columns of a joint (coordinates, then speeds) or a body (pose, then speeds).
std::vector<TrajectoryColumn> JointColumns(const MechanismDescription& user, std::size_t joint);
std::vector<TrajectoryColumn> BodyColumns(const MechanismDescription& user, std::size_t body);

// One row of a trajectory: all quantities of the user's mechanism at one time.

/// State of a mechanism at one time of a run.
struct RunSample {
  double t = 0.0;
  std::vector<BodyMotion> bodies;  ///< by the user's body
  /// By the user's joint: its coordinate with full turns if the run integrates it, else NaN.
  std::vector<double> followed;
  double supplied = 0.0, dissipated = 0.0;  ///< work since the start [J]; NaN if unknown
};

class RowWriter {
 public:
  virtual ~RowWriter() = default;
  /// Writes the quantities of TrajectoryColumns(), in their order. Spatial angles and signs of
  /// quaternions are continuous: closest to the last row, or to a followed coordinate.
  virtual void Write(const RunSample& moment, std::vector<double>* row) = 0;
  /// Returns labels of reactions and drives that were not unique so far, with the number of rows.
  virtual std::vector<std::pair<std::string, std::int64_t>> Open() const = 0;
};

/// Makes a writer for planar or spatial mechanisms. The arguments must outlive it.
std::unique_ptr<RowWriter> MakeRowWriter(const MechanismDescription& user,
                                         const OutputOptions& output);

}  // namespace loopbench::harness
