// References: snapshots, files, and errors of a run against them.
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "harness/base/record.h"
#include "harness/config/experiment.h"
#include "harness/config/published_series.h"
#include "mechanism/simplify/compile.h"

namespace loopbench::harness {

// States of a mechanism in the user's terms, independent of preprocessing, and their distance.

/// Pose and velocity of a body, in the user's ground axes, at the body's origin.
struct BodyState {
  Frame pose;
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();          ///< [m/s]
  Eigen::Vector3d angular_velocity = Eigen::Vector3d::Zero();  ///< [rad/s]
};

struct Snapshot {
  std::vector<BodyState> bodies;  ///< by the user's body, Ground included
  /// By the user's joint: its coordinate [rad or m] if it has just one, else NaN.
  std::vector<double> joints;
  std::vector<double> rates = {};  ///< rates of these coordinates; NaN if not taken
  double energy = 0.0;             ///< kinetic and potential [J]; NaN if unknown for the whole
};

/// A point of a user's body, in its axes from its origin [m].
struct MeasuredPoint {
  std::size_t body = 0;
  Eigen::Vector3d at = Eigen::Vector3d::Zero();
};

/// A measured mechanism: the user's description and its preprocessed form.
struct Measured {
  const MechanismDescription& user;
  const Compiled& compiled;
  /// Points at which distances are taken; empty: all of PointsOf().
  std::vector<MeasuredPoint> points = {};
};

/// Returns true if the first coordinate of a joint is a length, not an angle.
bool IsLength(const MechanismDescription& user, std::size_t joint);

/// Origins, centres of mass and named points of all bodies but Ground.
std::vector<MeasuredPoint> PointsOf(const MechanismDescription& user);

/// Returns a snapshot of all bodies: those fixed to Ground at their poses, others at the origin.
Snapshot EmptySnapshot(const Measured& measured);

/// Returns the same state for one part's body, at its centre of mass in the part's ground axes.
template <class Space, class S>
BodyState StateAtCentre(const Pose<Space, S>& pose, const Velocity<Space, S>& motion);

/// Enters a part's body, with all that is fixed to it.
void EnterBody(const Measured& measured, int part, int body, const BodyState& at_centre,
               Snapshot* snapshot);
/// Enters the coordinate of a joint of a part's description and its rate, which may be NaN.
void EnterJoint(const Measured& measured, int part, int joint, double coordinate, double rate,
                Snapshot* snapshot);

/// Sets the snapshot of one part at `kinematics`, rounded to double; other parts are unchanged.
template <class Space, class S>
void TakeSnapshot(const Measured& measured, int part, const Kinematics<Space, S>& kinematics,
                  Snapshot* snapshot) {
  const Mechanism<Space, S>& mechanism = kinematics.mechanism();
  for (int body = 1; body < mechanism.num_bodies(); ++body) {
    const auto index = static_cast<std::size_t>(body);
    EnterBody(measured, part, body,
              StateAtCentre<Space, S>(kinematics.poses()[index], kinematics.motions()[index]),
              snapshot);
  }
  for (int j = 0; j < static_cast<int>(mechanism.joints().size()); ++j) {
    const auto& joint = mechanism.joints()[static_cast<std::size_t>(j)];
    if (joint.description < 0 || joint.kind->num_u != 1) continue;
    EnterJoint(measured, part, joint.description,
               static_cast<double>(kinematics.JointCoordinate(j)),
               static_cast<double>(kinematics.JointSpeed(j)), snapshot);
  }
  snapshot->energy = static_cast<double>(ComputeEnergy(kinematics).total());
}

/// Largest distances between two snapshots of one subsystem (-1: of all).
struct Distance {
  double position = 0.0;          ///< of named points, origins and centres of mass [m]
  double rotation = 0.0;          ///< of bodies [rad]
  double velocity = 0.0;          ///< of the points [m/s]
  double angular_velocity = 0.0;  ///< [rad/s]
  double angle = 0.0;             ///< of joint coordinates [rad], without whole turns
  double displacement = 0.0;      ///< of joint coordinates [m]
  double energy = 0.0;            ///< [J]; NaN if one is unknown
  /// Time shift of `a` behind `b`, to first order: least squares over the points, weighted by b's
  /// speeds [s]; and the largest remaining distance [m]. NaN and the position error if b is at
  /// rest.
  double late = 0.0, shape = 0.0;
  double speed = 0.0;  ///< of b's points, root of the mean square [m/s]
};
/// Distances of a reference's file and of records, with their names there.
inline constexpr std::pair<const char*, double Distance::*> kDistances[] = {
    {"position", &Distance::position}, {"rotation", &Distance::rotation},
    {"velocity", &Distance::velocity}, {"angular_velocity", &Distance::angular_velocity},
    {"angle", &Distance::angle},       {"displacement", &Distance::displacement},
    {"energy", &Distance::energy}};
Distance DistanceOf(const Measured& measured, int part, const Snapshot& a, const Snapshot& b);

/// The larger of each.
Distance Larger(const Distance& a, const Distance& b);

template <class Space, class S>
BodyState StateAtCentre(const Pose<Space, S>& pose, const Velocity<Space, S>& motion) {
  BodyState state;
  for (int i = 0; i < Space::kLin; ++i) {
    state.pose.p[i] = static_cast<double>(pose.p[i]);
    state.velocity[i] = static_cast<double>(motion.linear[i]);
    for (int j = 0; j < Space::kLin; ++j) state.pose.R(i, j) = static_cast<double>(pose.R(i, j));
  }
  for (int i = 0; i < Space::kRot; ++i) {
    state.angular_velocity[Space::kRot == 1 ? 2 : i] = static_cast<double>(motion.angular[i]);
  }
  return state;
}

// A reference solution: states of a mechanism at given times, with their certified error.
//
// harness/precision/make_reference.h computes them. A file holds one reference: one line of JSON
// with a checksum (harness/base/record.h).

/// Errors are measured until the reference's own error exceeds this share of a link: a tenth of the
/// smallest error in double that exceeds round-off over long horizons.
inline constexpr double kCertifiedShare = 1e-9;

struct Reference {
  /// Name of the outcome of its start, or of the first integration that ended early.
  std::string outcome = "finished";
  std::string message;  ///< reason for no reference or an early end
  /// "long-double", "gragg 20(19): lagrange 1e-17, lagrange 1e-15, odca 1e-16".
  std::string scalar, witnesses;
  std::vector<double> times;        ///< [s], the start and the end among them
  std::vector<Snapshot> snapshots;  ///< by time, up to the shortest integration
  std::vector<Distance> bounds;     ///< certified errors of the snapshots; `late` is not known
  double trust_horizon = 0.0;       ///< [s] of the last time before bounds exceed kCertifiedShare
  double cpu_s = 0.0;
  std::int64_t rhs_evaluations = 0;  ///< of all integrations

  /// The largest bound up to the trust horizon.
  Distance Certified() const;
  /// Number of times up to the trust horizon.
  std::size_t NumTrusted() const;
};

/// Returns the name of a problem's reference. It depends on the problem alone, not on the version
/// of this program, so that references are reused.
std::string ReferenceId(const ExperimentProblem& problem, double horizon,
                        const ReferenceOptions& options);

/// The file of a reference beside a store's `file`.
std::filesystem::path ReferencePath(const std::filesystem::path& store_file, const std::string& id);

void WriteReference(const std::filesystem::path& path, const std::string& id,
                    const MechanismDescription& user, const Reference& reference);
/// Reads a reference, if there is a file. Throws std::runtime_error for a damaged or foreign one.
std::optional<Reference> ReadReference(const std::filesystem::path& path, const std::string& id,
                                       const MechanismDescription& user);

// The certified references beside several stores, put beside one.

struct MergedReferences {
  std::map<std::string, std::string> texts;  ///< file name in references/ and content
  std::vector<std::string> notes;            ///< certificate that was kept if two differ
};

/// Reads all references of stores (`store_files`: their results.jsonl). References of one name must
/// agree in all but their computing time; otherwise the one certified longer, and then to less, is
/// kept. Throws std::runtime_error, with the file's name, for damaged or foreign references.
MergedReferences MergeReferences(const std::vector<std::filesystem::path>& store_files);

/// Writes them beside the store.
void WriteReferences(const MergedReferences& references, const std::filesystem::path& store_file);

/// Compares a run with known data of its motion: a certified reference or published data.
class Meter {
 public:
  virtual ~Meter() = default;

  /// When the run is looked at [s], rising.
  virtual const std::vector<double>& times() const = 0;

  /// Adds the run at times()[k], and its interpolant of one degree less: their distance is a lower
  /// estimate of the interpolation error.
  virtual void Add(std::size_t k, const Snapshot& own, const Snapshot& lower) = 0;

  virtual void Write(Record& record) const = 0;
};

/// Measures the true error of one subsystem's run where a reference is certified. Energies are
/// relative to the first snapshot, at the start: simplified models may omit immovable bodies.
/// Writes errors at the end, their maximum and mean (keys error_*, docs/errors-and-costs.md), and
/// series.error. Omits the error at the end if the run or the certificate ends earlier. Referents
/// of `measured` and the reference outlive the meter.
std::unique_ptr<Meter> MakeMeter(const Measured& measured, int part, const Reference& reference);

/// Measures the error of one subsystem's run against published data
/// (harness/config/published_series.h), up to `horizon` [s], in the measures of a certified
/// reference. Quantities without published data are left out; errors of points use the axes of the
/// series. "error_over_uncertainty" is the largest deviation from a published number over its
/// uncertainty. At 1 and below the run agrees with the series. Referents outlive the meter.
std::unique_ptr<Meter> MakeMeter(const Measured& measured, int part, const PublishedSeries& series,
                                 double horizon);

/// Writes reference, reference_runs, reference_error and reference_valid_until.
void WriteCertificate(const Reference& reference, Record& record);

/// Writes the keys of the published data: reference, reference_runs (name and source),
/// reference_error and its counterparts for each measure, and reference_valid_until, the last time
/// within `horizon`.
void WriteCertificate(const MechanismDescription& user, const PublishedSeries& series,
                      double horizon, Record& record);

}  // namespace loopbench::harness
