// Trajectories: columns, files, the motion of the user's bodies, checks, statics.
#pragma once

#include <Eigen/Geometry>
#include <filesystem>
#include <fstream>
#include <memory>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "harness/base/record.h"
#include "harness/base/text.h"
#include "harness/config/experiment.h"
#include "harness/observers/reference.h"
#include "mechanism/description/joint_frames.h"
#include "mechanism/formulation/system.h"
#include "mechanism/loops/tree_dynamics.h"
#include "mechanism/model/kinematics.h"
#include "mechanism/simplify/compile.h"
#include "mechanism/start/assembly.h"

namespace loopbench::harness {

/// Motion in the user's ground axes, at the body's origin; accelerations are of material points.
struct BodyMotion {
  Frame pose;
  double angle = 0.0;  ///< of planar problems, with full turns [rad]
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();              ///< [m/s]
  Eigen::Vector3d angular_velocity = Eigen::Vector3d::Zero();      ///< [rad/s]
  Eigen::Vector3d acceleration = Eigen::Vector3d::Zero();          ///< [m/s^2]
  Eigen::Vector3d angular_acceleration = Eigen::Vector3d::Zero();  ///< [rad/s^2]

  /// Returns the position, velocity or acceleration, in ground axes, of a point in body axes.
  Eigen::Vector3d PointAt(const Eigen::Vector3d& at) const { return pose.p + pose.R * at; }
  Eigen::Vector3d VelocityAt(const Eigen::Vector3d& at) const {
    return velocity + angular_velocity.cross(pose.R * at);
  }
  Eigen::Vector3d AccelerationAt(const Eigen::Vector3d& at) const {
    const Eigen::Vector3d r = pose.R * at;
    return acceleration + angular_acceleration.cross(r) +
           angular_velocity.cross(angular_velocity.cross(r));
  }
};

/// Returns all bodies at rest at the origin; bodies merged with Ground have their fixed pose.
std::vector<BodyMotion> AtRest(const Compiled& compiled);

/// Sets all bodies of one part. `accelerations`: at the centres of mass; if empty, NaN.
template <class Space>
void EnterPart(const Compiled& compiled, int part, const Kinematics<Space, double>& kinematics,
               std::span<const Acceleration<Space, double>> accelerations,
               std::vector<BodyMotion>* bodies);

/// Largest constraint violation of one joint.
struct JointMismatch {
  double shift = 0.0;             ///< [m]
  double rotation = 0.0;          ///< [rad]
  double velocity = 0.0;          ///< [m/s]
  double angular_velocity = 0.0;  ///< [rad/s]
};

/// The user's original mechanism, with nothing compiled away, at given body motions. Joint values,
/// forces and energies of a trajectory are computed from body motions alone: of Loopbench runs,
/// however they were compiled and integrated, and of other programs.
template <class Space>
class UserMechanism {
 public:
  explicit UserMechanism(const MechanismDescription& user);

  /// Sets the state from `bodies`, indexed by the user's body, Ground included. Angles of joints
  /// in space include full turns. They continue from `followed` (by joint, NaN if unknown),
  /// otherwise from the last call, at first from the initial values.
  void Set(double t, std::span<const BodyMotion> bodies, std::span<const double> followed = {});

  const Mechanism<Space, double>& mechanism() const { return mechanism_; }
  const Kinematics<Space, double>& kinematics() const { return kinematics_; }

  /// Computes at most seven coordinates (a spatial angle's principal value) and six speeds.
  void Measure(int joint, double* q, double* u) const;
  /// Returns the direction of the i-th speed of a joint, prescribed or not, at the joint's point.
  const Direction<Space, double>& DirectionOfSpeed(int joint, int i) const;

  /// Returns the constraint violation of a joint of the user.
  JointMismatch MismatchOf(int joint) const;
  /// Returns the largest of all rotations [rad] and of all shifts over the mechanism's length.
  double RelativeMismatch() const;

 private:
  Mechanism<Space, double> mechanism_;  ///< in absolute coordinates, nothing released
  Kinematics<Space, double> kinematics_;
  std::vector<Eigen::Vector3d> com_;
  VectorX<double> q_, u_;
};

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

/// State of a mechanism at one time of a run.
struct RunSample {
  double t = 0.0;
  std::vector<BodyMotion> bodies;  ///< by the user's body
  /// By the user's joint: its coordinate with full turns if the run integrates it, else NaN.
  std::vector<double> followed;
  double supplied = 0.0, dissipated = 0.0;  ///< work since the start [J]; NaN if unknown
  bool is_regularized = false;  ///< without accelerations: they would be of the regularization
};

class RowWriter {
 public:
  virtual ~RowWriter() = default;
  /// All columns of the mechanism and the output's parts, "t [s]" first.
  virtual const std::vector<TrajectoryColumn>& columns() const = 0;
  /// Writes the values of the columns. Spatial angles and signs of quaternions are continuous:
  /// closest to the last row, or to a followed coordinate.
  virtual void Write(const RunSample& moment, std::vector<double>* row) = 0;
  /// Returns labels of reactions and drives that were not unique so far, with the number of rows.
  /// Rows of regularized samples do not count; OpenByRegularization() is their number of values.
  virtual std::vector<std::pair<std::string, std::int64_t>> Open() const = 0;
  virtual std::int64_t OpenByRegularization() const = 0;
};

/// Makes a writer for planar or spatial mechanisms. The arguments must outlive it.
std::unique_ptr<RowWriter> MakeRowWriter(const MechanismDescription& user,
                                         const OutputOptions& output);

/// Reads a trajectory file of any length row by row: CSV, in which lines that begin with "#" are
/// notes, followed by a line of labels (above) and a line per time. An unknown number is nan or an
/// empty cell. Files of other programs may have any subset of the labels, in any order. Throws
/// std::runtime_error with file, line, found and expected text.
class TrajectoryReader {
 public:
  /// Reads the labels, which must be unique and contain "t [s]". An unknown label becomes a column
  /// with an empty kind, whose component is the text of the label.
  explicit TrajectoryReader(const std::filesystem::path& path);

  const std::vector<TrajectoryColumn>& columns() const { return columns_; }
  std::size_t time() const { return time_; }  ///< column of t
  /// Returns the text of the lines above the labels, without "# ".
  const std::vector<std::string>& notes() const { return notes_; }
  /// Returns the notes below the labels that have been read so far.
  const std::vector<std::string>& later_notes() const { return later_notes_; }

  /// Reads the next row, a number per column; returns false at the end. Times must increase.
  bool Next(std::vector<double>* row);
  /// Throws if one of `columns` is not finite in `row`, the last row read.
  void RequireNumbers(const std::vector<double>& row, std::span<const std::size_t> columns) const;

 private:
  bool NextLine();
  [[noreturn]] void Refuse(const std::string& found, const std::string& expected) const;

  std::filesystem::path path_;
  std::ifstream in_;
  std::string line_;
  std::size_t number_ = 0, time_ = 0;  ///< line number, from 1; column of t
  double last_t_ = 0.0;
  bool has_row_ = false;
  std::vector<TrajectoryColumn> columns_;
  std::vector<std::string> notes_, later_notes_;
};

/// All rows of a file.
struct Trajectory {
  std::vector<TrajectoryColumn> columns;
  std::vector<double> values;  ///< row after row
  std::size_t time = 0;        ///< column of t

  std::size_t rows() const { return columns.empty() ? 0 : values.size() / columns.size(); }
  double At(std::size_t row, std::size_t column) const {
    return values[row * columns.size() + column];
  }
  double Time(std::size_t row) const { return At(row, time); }
};
Trajectory ReadTrajectory(const std::filesystem::path& path);

/// Returns the column with this name by LabelName(), of points and couplings two with a colon.
std::optional<std::size_t> FindColumn(const std::vector<TrajectoryColumn>& columns,
                                      std::string_view kind, std::string_view name,
                                      std::string_view component);

/// Columns that hold the pose of a body.
struct PoseColumns {
  std::vector<std::size_t> columns;  ///< x, y, angle, or x, y, z, qw, qx, qy, qz
  bool planar = true;

  /// Returns the pose in a row; NaN if a number is NaN. Normalizes the quaternion.
  Frame At(const double* row) const;
};
/// Returns nothing if a column of the pose is missing.
std::optional<PoseColumns> FindPose(const std::vector<TrajectoryColumn>& columns,
                                    std::string_view body);

/// Returns the path trajectories/ID.csv next to a store's `file`.
std::filesystem::path TrajectoryPath(const std::filesystem::path& store_file,
                                     const std::string& id);

enum class TrajectoryFormat { kCsv, kJsonLines };

/// Writes a trajectory row by row, with fixed memory. Rows go to PATH.part, which is renamed to
/// PATH when complete: PATH is never a partial file. The destructor deletes an unfinished part. A
/// killed process leaves its part for RemoveParts().
class TrajectoryWriter {
 public:
  /// Creates missing folders. In CSV, `notes` become lines with "#". This class throws
  /// std::runtime_error on system errors.
  TrajectoryWriter(const std::filesystem::path& path, const std::vector<TrajectoryColumn>& columns,
                   const std::vector<std::string>& notes,
                   TrajectoryFormat format = TrajectoryFormat::kCsv, Onto onto = Onto::kNoInput);
  TrajectoryWriter(const TrajectoryWriter&) = delete;
  TrajectoryWriter& operator=(const TrajectoryWriter&) = delete;

  /// Writes numbers that can be read back exactly; missing values as nan, in JSON as null.
  void Write(std::span<const double> row);
  std::int64_t rows() const { return rows_; }

  /// Completes the file on disk; call once. Returns the hash of all its bytes.
  std::string Finish(const std::vector<std::string>& notes = {});

 private:
  void Note(const std::string& note);
  void Flush();

  OutputFile file_;
  FnvHash hash_;
  TrajectoryFormat format_;
  std::vector<std::string> labels_;  ///< labels as JSON strings
  std::string buffer_;
  std::int64_t rows_ = 0;
};

/// Removes parts of killed runs: all next to a store's `file`, or the part of one `path`.
void RemoveParts(const std::filesystem::path& store_file);
void RemovePart(const std::filesystem::path& path);

/// Returns the trajectory file of a record, next to the store's `file`; empty if the record has
/// none. Names outside the folder of trajectories are ignored.
std::filesystem::path TrajectoryOf(const Record& record, const std::filesystem::path& store_file);

/// Error for a file of a store that has changed since its run.
class ChangedFile : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Throws ChangedFile if the record (since 1.1) has another "trajectory_hash".
void VerifyTrajectory(const Record& record, const std::filesystem::path& file);

/// Copies each trajectory of `records` completely from the first of `stores` that has it to the
/// folder of `target`. Returns the names of trajectories that no store has unchanged.
std::vector<std::string> CopyTrajectories(const std::vector<Record>& records,
                                          const std::vector<std::filesystem::path>& stores,
                                          const std::filesystem::path& target);

/// Output file and options of a trajectory.
struct TrajectoryTask {
  const OutputOptions& output;
  std::filesystem::path path;
  std::string title;  ///< title of the case
};

/// Converts integrator states into trajectory rows of the user's mechanism, which is one part.
template <class Space>
class Recorder {
 public:
  /// `user`, `compiled`, `mechanism` and the references in `task` must outlive it.
  Recorder(const MechanismDescription& user, const Compiled& compiled,
           const Mechanism<Space, double>& mechanism, const TrajectoryTask& task);

  /// Writes a row for an integrator state at a step end or between steps. The state contains
  /// positions, speeds, and works if integrated. `lower`: a less exact one or the same.
  void TakeAt(double t, System<Space, double>& system, std::span<const double> y,
              std::span<const double> lower);
  /// Writes a row from the evaluated state of `system`; known accelerations are its udot(). `work`
  /// contains supplied and dissipated work; empty if not integrated.
  void Take(double t, const System<Space, double>& system, bool has_accelerations,
            std::span<const double> work);

  /// Completes the file and sets its record keys. Without recorded states the file has no rows.
  void Finish(Record& record);

 private:
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
  std::int64_t regularized_rows_ = 0;  ///< of a driven mechanism: without reactions
  double first_regularized_t_ = 0.0, last_regularized_t_ = 0.0;  ///< their times [s]
  std::unique_ptr<RowWriter> rows_;
  std::optional<TrajectoryWriter> file_;  ///< opened with the first row
  std::vector<double> row_;
};

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

struct ColumnCheck {
  std::string label;  ///< label of the speed
  LargestAt apart;    ///< difference from the positions, in its unit
};

struct TrajectoryCheck {
  std::int64_t rows = 0;
  double from = 0.0, to = 0.0;  ///< [s]
  std::string source;           ///< "body poses" or "joint coordinates"
  bool has_speeds = false;
  std::vector<JointCheck> joints;  ///< joints of the mechanism, then couplings
  LargestAt energy;                ///< change of kinetic + potential - supplied + dissipated [J]
  double kinetic = 0.0;            ///< largest [J]
  std::string no_energy;           ///< reason why the energy is unknown; or empty
  /// Energies of the file minus energies of the mechanism [J]; unknown without speeds.
  std::array<ColumnCheck, 2> energies;
  std::vector<std::string> unchecked;  ///< labels of forces, reactions and work
  /// Mean speed over two steps by the parabola through three speeds (Simpson's rule), minus the
  /// difference of positions. They differ by (h^4 / 90) times the fourth derivative of the speed.
  std::vector<ColumnCheck> speeds;
  std::vector<std::string> unknown;  ///< labels that do not exist in the mechanism
};

/// Checks a trajectory of any program against a mechanism, row by row, with fixed memory:
/// constraint violation, energy, and consistency of speeds with positions. Throws as
/// TrajectoryReader, and std::runtime_error for missing columns, no rows or a row with a non-finite
/// number in a motion column.
TrajectoryCheck CheckTrajectory(const std::filesystem::path& path,
                                const MechanismDescription& user);

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

/// Returns the time of the first row that ValueAt() uses at a time within the trajectory.
double FirstTimeFor(const Trajectory& ours, double t);

/// Returns `theirs` minus `ours` at times of `theirs`, angles modulo turns; NaN outside `ours`.
std::vector<double> Differences(const Trajectory& ours, const Trajectory& theirs,
                                const SharedColumn& column);

/// Forces at rest: efforts of drives that hold a mechanism at its start, and joint reactions.
///
/// All speeds and accelerations are zero, at t = 0: gravity, springs and constant forces act,
/// dampers and drag do not. Prescribed coordinates are held at their values. As many other
/// coordinates are held as degrees of freedom remain: of "fixed" joints first, then in the order of
/// the file, without those that held ones determine. Efforts and reactions follow from the
/// equilibrium of each body.
struct Statics {
  std::string why;  ///< why there are no forces: something moves that nothing can hold; else empty
  /// Drives (columns "drive"), reactions ("reaction") and efforts of couplings ("coupling"), in
  /// ground axes; NaN if redundant constraints share the load in no one way.
  std::vector<TrajectoryColumn> columns;
  std::vector<double> values;
  std::vector<std::string> held;  ///< names of columns of drives that the file does not prescribe
  int free = 0;                   ///< motions that nothing holds and no force drives: idle freedoms
};

/// `start` is a start of the description in joint coordinates that is assembled.
Statics FindStatics(const MechanismDescription& description, const Start<double>& start);

}  // namespace loopbench::harness
