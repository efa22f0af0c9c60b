// Columns of a trajectory: their names and units, and a row of values.
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

// The columns of a trajectory: what they are called, in which unit, in which order.
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
// In the plane z, qw, mx and the like are left out. In names a backslash stands before ':' and '\',
// control characters are shown, so that a label has one line and one reading; CSV quotes the rest.

struct TrajectoryColumn {
  std::string kind;       ///< "joint", "body", ...; "t"
  std::string name;       ///< of whom, as written between the colons; may be empty
  std::string component;  ///< "angle", "x", ...
  std::string unit;

  /// "joint:A:angle [rad]".
  std::string Label() const;
  friend bool operator==(const TrajectoryColumn&, const TrajectoryColumn&) = default;
};

/// A name as labels have it.
std::string LabelName(std::string_view name);

/// What a label says; nothing for one that is none.
std::optional<TrajectoryColumn> ParseLabel(std::string_view label);

/// All columns of a mechanism, "t [s]" first.
std::vector<TrajectoryColumn> TrajectoryColumns(const MechanismDescription& user,
                                                const OutputOptions& output);

/// Of one joint: its coordinates, then its speeds. Of one body: its pose, then its speeds.
std::vector<TrajectoryColumn> JointColumns(const MechanismDescription& user, std::size_t joint);
std::vector<TrajectoryColumn> BodyColumns(const MechanismDescription& user, std::size_t body);

// One row of a trajectory: all quantities of the user's mechanism at one time.

/// A mechanism at one time, as a run knows it.
struct MomentOfRun {
  double t = 0.0;
  std::vector<BodyMotion> bodies;  ///< by the user's body
  /// By the user's joint: its coordinate where the run follows one, with whole turns, else NaN.
  std::vector<double> followed;
  double supplied = 0.0, dissipated = 0.0;  ///< work since the start [J]; NaN where not known
};

class RowWriter {
 public:
  virtual ~RowWriter() = default;
  /// The quantities of TrajectoryColumns(), in their order. Angles in space and signs of
  /// quaternions go on from the last row: the nearest to those there, or to what is followed.
  virtual void Write(const MomentOfRun& moment, std::vector<double>* row) = 0;
  /// Labels of reactions and drives that were not unique in some row so far, and in how many rows.
  virtual std::vector<std::pair<std::string, std::int64_t>> Open() const = 0;
};

/// Of the user's space. What is given outlives it.
std::unique_ptr<RowWriter> MakeRowWriter(const MechanismDescription& user,
                                         const OutputOptions& output);

}  // namespace loopbench::harness
