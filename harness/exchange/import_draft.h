// A mechanism under construction by an importer: placements, plane, rounding.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <functional>
#include <map>
#include <numbers>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "harness/exchange/export_names.h"
#include "harness/exchange/import.h"
#include "harness/exchange/xml_file.h"
#include "mechanism/description/joint_frames.h"

namespace loopbench::harness {

// Where a frame stands in another one, and the forms in which XML formats say orientations.
//
// Orientations are quaternions, so that a turn about one axis stays one to the last bit.

inline constexpr double kDegree = std::numbers::pi / 180.0;  ///< [rad]

struct Placement {
  Placement() = default;
  explicit Placement(const Eigen::Vector3d& origin) : p(origin) {}
  Placement(const Eigen::Quaterniond& turn, const Eigen::Vector3d& origin) : q(turn), p(origin) {}

  Eigen::Quaterniond q = Eigen::Quaterniond::Identity();
  Eigen::Vector3d p = Eigen::Vector3d::Zero();

  /// X_AC from X_AB and X_BC.
  friend Placement operator*(const Placement& X_AB, const Placement& X_BC) {
    return {X_AB.q * X_BC.q, X_AB.p + X_AB.q * X_BC.p};
  }
  /// A point given in B, in A.
  Eigen::Vector3d At(const Eigen::Vector3d& point) const { return p + q * point; }
  Placement Inverse() const { return {q.conjugate(), q.conjugate() * Eigen::Vector3d(-p)}; }
  Frame AsFrame() const { return {q.toRotationMatrix(), p}; }
};

/// The rotation vector of a unit quaternion, at most half a turn [rad].
Eigen::Vector3d RotationVector(const Eigen::Quaterniond& q);

/// Rz(yaw) Ry(pitch) Rx(roll): the fixed-axes angles of URDF and SDF [rad].
Eigen::Quaterniond FromRollPitchYaw(const Eigen::Vector3d& angles);

/// Turns about axes one after the other: 'x', 'y', 'z' about those that turn with it, 'X', 'Y', 'Z'
/// about those that stand still (MJCF's eulerseq) [rad].
Eigen::Quaterniond FromEuler(const std::string& sequence, const Eigen::Vector3d& angles);

/// The shortest turn that takes z there; half a turn about x to the other side, as MuJoCo's.
Eigen::Quaterniond TurnOfZ(const Eigen::Vector3d& to);

/// An inertia in axes B, in axes A; q is R_AB. The same bits where they are parallel.
Eigen::Matrix3d InTurnedAxes(const Eigen::Quaterniond& q, const Eigen::Matrix3d& inertia);

/// The matrix with these elements, xx, yy, zz, xy, xz, yz.
Eigen::Matrix3d SymmetricMatrix(double xx, double yy, double zz, double xy, double xz, double yz);

// A mechanism while it is imported, in whatever format: what the readers of the formats fill, and
// what is done with it afterwards.

/// Why what nobody read has no place in a mechanism, by attributes ("@armature joint@ref") and tags
/// ("visual"). Without a reason nothing is noted: it says nothing about the motion.
struct DroppedReason {
  std::string_view words;  ///< with spaces between
  std::string_view reason;
  bool changes_motion = false;

  bool Has(const std::string& word) const {
    return (" " + std::string(words) + " ").find(" " + word + " ") != std::string::npos;
  }
};

class ImportDraft {
 public:
  ImportDraft(const XmlFile& file, const ImportOptions& options);

  MechanismDescription description;
  std::vector<Placement> at_rest;  ///< of bodies in ground axes where all coordinates are 0

  /// A body of that name, or of the next free number where it is "". Refuses one that is taken.
  /// Mass 0 until it is set.
  int AddBody(const XmlElement& element, const std::string& name);
  /// The index of a body that must be there; `also` are further names of Ground.
  int BodyNamed(const XmlValue& value, const std::set<std::string>& also = {}) const;
  int BodyNamed(const std::string& name, const XmlElement& user) const;
  int LineOf(int body) const { return lines_[static_cast<std::size_t>(body)]; }

  /// A name that no joint has.
  std::string NewJointName(const XmlElement& element, const std::string& name);
  /// For the joint that is added next, which the file does not name: it is called `stem`, or nearly
  /// so where the file has a joint of that name. "" until all joints are read.
  std::string NameLater(const std::string& stem);
  /// From X_PF on `from` to X_QM on `to`. The joint stays where it is until the next one is added.
  JointDescription& AddJoint(const std::string& name, JointType type, int from,
                             const Placement& X_PF, int to, const Placement& X_QM);
  int last_joint() const { return static_cast<int>(description.joints.size()) - 1; }

  /// The body's mass stands in a file that is not read: if the body moves, `value` is rejected.
  void LeaveMass(int body, const XmlValue& value) { without_mass_.emplace_back(body, value); }
  /// As many times its weight, upwards: what a body without gravity feels.
  void AddLift(int body, double share);

  /// What the format takes where the file says nothing [m/s^2], along -z.
  void AssumeGravity(const XmlElement& element, double gravity);

  /// The numbers of a value by their `kinds`: 'a' an angle [rad], 'd' the 3 of a direction, 'q' the
  /// 4 of a quaternion, 'r' with its scalar last, 'n' others. Rounded ones are exact, and noted.
  std::vector<double> Numbers(const XmlValue& value, std::string_view kinds);
  /// 3 of them.
  Eigen::Vector3d Vector(const XmlValue& value, std::string_view kinds);

  void Note(const XmlElement& element, std::string reason, bool changes_motion = false);
  void Note(const XmlElement& element, const std::string& attribute, std::string reason,
            bool changes_motion = false);
  /// A note for all that was not read.
  void NoteUnread(std::span<const DroppedReason> reasons);

  /// Sidecar, floating parts, bodies that are fixed together, plane; then it is a mechanism.
  Imported Finish(const std::string& format);

 private:
  void NameJoints();
  void HoldFloatingParts();
  void CheckUnreadMasses() const;
  /// Merges bodies that are none by themselves with those that welds fix them to; with `whole`, all
  /// bodies that are fixed together with one of them.
  void MergeFixed(bool whole);
  /// Refuses masses and inertias of bodies that move, with all that was merged.
  void CheckMasses() const;
  void MakeBallsPins(const Eigen::Vector3d& n);
  void GoToPlane();

  const XmlFile& file_;
  const ImportOptions& options_;
  std::vector<XmlElement> elements_;  ///< of bodies; the root element for Ground
  std::vector<int> lines_;
  std::map<std::string, int> bodies_;
  exchange::UniqueNames joints_;
  std::vector<std::pair<std::size_t, std::string>> stems_;  ///< of joints without names
  std::vector<ImportNote> notes_;
  std::size_t rounded_ = 0, rounded_note_ = 0;  ///< values that were rounded; the note of the first
  std::vector<std::pair<int, double>> lifts_;
  std::vector<std::pair<int, XmlValue>> without_mass_;
  std::optional<XmlElement> assumed_gravity_;  ///< who would have had to say it
};

/// Of length 1; refuses one that is zero, which `value` says.
Eigen::Quaterniond UnitQuaternion(const XmlValue& value, const Eigen::Quaterniond& q);

/// The readers of the formats; each fills the draft from the root element.
void ReadMjcf(const XmlElement& root, ImportDraft* draft);
void ReadUrdf(const XmlElement& root, const ImportOptions& options, ImportDraft* draft);
void ReadSdf(const XmlElement& root, ImportDraft* draft);

}  // namespace loopbench::harness
