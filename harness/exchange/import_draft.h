// A mechanism during its import: poses, planar reduction, exact values.
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
#include "mechanism/simplify/attach.h"

namespace loopbench::harness {

// Pose of a frame in another one, and orientation notations of XML formats.
//
// Orientations are quaternions, so that a rotation about one axis stays exactly about that axis.

inline constexpr double kDegree = std::numbers::pi / 180.0;  ///< [rad]

struct Placement {
  Placement() = default;
  explicit Placement(const Eigen::Vector3d& origin) : p(origin) {}
  Placement(const Eigen::Quaterniond& turn, const Eigen::Vector3d& origin) : q(turn), p(origin) {}

  Eigen::Quaterniond q = Eigen::Quaterniond::Identity();
  Eigen::Vector3d p = Eigen::Vector3d::Zero();

  /// Returns X_AC from X_AB and X_BC.
  friend Placement operator*(const Placement& X_AB, const Placement& X_BC) {
    return {X_AB.q * X_BC.q, X_AB.p + X_AB.q * X_BC.p};
  }
  /// Converts a point from B to A.
  Eigen::Vector3d At(const Eigen::Vector3d& point) const { return p + q * point; }
  Placement Inverse() const { return {q.conjugate(), q.conjugate() * Eigen::Vector3d(-p)}; }
  Frame AsFrame() const { return {q.toRotationMatrix(), p}; }
  /// Returns the coordinates of a free joint.
  std::vector<double> AsCoordinates() const {
    return {q.w(), q.x(), q.y(), q.z(), p.x(), p.y(), p.z()};
  }
};

/// Returns the rotation vector of a unit quaternion, at most half a turn [rad].
Eigen::Vector3d RotationVector(const Eigen::Quaterniond& q);

/// Returns Rz(yaw) Ry(pitch) Rx(roll): the fixed-axes angles of URDF and SDF [rad].
Eigen::Quaterniond FromRollPitchYaw(const Eigen::Vector3d& angles);

/// Returns successive rotations: 'x', 'y', 'z' about body-fixed axes, 'X', 'Y', 'Z' about
/// space-fixed axes (MJCF's eulerseq) [rad].
Eigen::Quaterniond FromEuler(const std::string& sequence, const Eigen::Vector3d& angles);

/// Returns the shortest rotation from z to `to`; for -z half a turn about x, as in MuJoCo.
Eigen::Quaterniond TurnOfZ(const Eigen::Vector3d& to);

/// Converts an inertia from axes B to A; q is R_AB. Bit-identical if the axes are parallel.
Eigen::Matrix3d InTurnedAxes(const Eigen::Quaterniond& q, const Eigen::Matrix3d& inertia);

/// Returns the symmetric matrix with elements xx, yy, zz, xy, xz, yz.
Eigen::Matrix3d SymmetricMatrix(double xx, double yy, double zz, double xy, double xz, double yz);

/// Returns true, after replacing all three principal moments by their mean, if one is larger than
/// the sum of the others; as MuJoCo's balanceinertia.
bool Balance(Eigen::Matrix3d* inertia);

/// Returns the inertia from its elements. `get`: returns the element of a name, "ixx" to "iyz", and
/// of a kind, true for moments.
template <class Get>
Eigen::Matrix3d InertiaOf(const Get& get) {
  return SymmetricMatrix(get("ixx", true), get("iyy", true), get("izz", true), get("ixy", false),
                         get("ixz", false), get("iyz", false));
}

// A mechanism during its import in any format: the format readers fill it, and Finish() completes
// it.

/// Reason why unread attributes ("@armature joint@ref") or tags ("visual") are dropped. Without a
/// reason no note is made: they have no influence on the motion.
struct DroppedReason {
  std::string_view words;  ///< with spaces between
  std::string_view reason;
  bool changes_motion = false;

  bool Has(const std::string& word) const {
    return (" " + std::string(words) + " ").find(" " + word + " ") != std::string::npos;
  }
};

inline constexpr const char* kDryFriction = "dry friction is no force of mechanism files";
/// Reasons why springs, dampers, efforts and rotors of a joint with several coordinates are
/// dropped.
inline constexpr const char* kNoRotors = "only joints with one coordinate have rotors";
inline constexpr const char* kNeedsOneCoordinate = "only joints with one coordinate have forces";
inline constexpr const char* kNotCoupled =
    "dropped: only joints with one coordinate follow others: this is a freedom more than in the "
    "file";
inline constexpr const char* kDrakeBall = "drake:ball_constraint";
inline constexpr const char* kNoEnds = "joints turn and slide without ends";

/// Returns the entry that a value names; if there is none, rejects the value with `expected`.
template <class Entry>
const Entry& Named(const std::map<std::string, Entry>& entries, const XmlValue& value,
                   std::string_view expected) {
  const auto found = entries.find(value.Name());
  if (found == entries.end()) value.Fail(expected);
  return found->second;
}

// Joints in series without mass between them (import_chain.cpp, import_links.cpp).

enum class SerialKind { kHinge, kSlide, kBall, kFree };

/// A joint of a series, in the drawn axes of the last body.
struct SerialJoint {
  SerialKind kind = SerialKind::kHinge;
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  ///< [m]
  Eigen::Vector3d axis = Eigen::Vector3d::UnitZ();     ///< of unit length
  double reference = 0.0;                              ///< its coordinate in the drawn position

  int num_q() const { return kind == SerialKind::kFree ? 7 : kind == SerialKind::kBall ? 4 : 1; }
  int num_u() const { return kind == SerialKind::kFree ? 6 : kind == SerialKind::kBall ? 3 : 1; }
};

/// The joint of a mechanism that a series forms.
struct ComposedJoint {
  JointType type = JointType::kWeld;
  Placement X_BJ;              ///< its frame on the last body, in drawn axes of that body
  bool from_is_child = false;  ///< it leads from the last body to the first
  bool keeps_angle = false;    ///< a planar joint that only slides
};

/// Returns the joint that a series forms, if there is one.
std::optional<ComposedJoint> Compose(const std::vector<SerialJoint>& joints);
/// Returns the motion of a joint, not a free one, at its coordinates `q`.
Placement MotionOf(const SerialJoint& joint, const double* q);
/// Converts several joints to one: coordinates from their common pose, speeds from the velocity
/// along the free directions, which contain it completely.
void SetComposed(const std::vector<SerialJoint>& series, const ComposedJoint& composed,
                 const double* q, const double* u, std::vector<double>* coordinates,
                 std::vector<double>* speeds);
struct MasslessChain;

class ImportDraft {
 public:
  ImportDraft(const XmlFile& file, const ImportOptions& options);

  MechanismDescription description;
  bool has_replicas = false;       ///< elements are read repeatedly: equal notes count once
  std::vector<Placement> at_rest;  ///< poses of bodies in ground axes at zero coordinates

  /// Adds a body; "" is replaced by the next free number. Rejects a name in use. The mass is
  /// initially 0.
  int AddBody(const XmlElement& element, const std::string& name);
  /// Adds a link without mass between joints of a body. References do not find it.
  int AddLink(const XmlElement& element, int body);
  /// Returns the index of an existing body; `also`: further names of Ground.
  int BodyNamed(const XmlValue& value, const std::set<std::string>& also = {}) const;
  int BodyNamed(const std::string& name, const XmlElement& user) const;
  /// As above; a failure shows the value as in the file.
  int BodyNamed(const std::string& name, const XmlValue& user) const;
  /// Returns the element of a body; the root element for Ground.
  const XmlElement& element(int body) const { return elements_[body]; }

  /// Returns the name of a new joint; rejects a name in use.
  std::string NewJointName(const XmlElement& element, const std::string& name);
  /// Returns "" for an unnamed joint that is added next. After all joints are read it is called
  /// `stem`, with a suffix if necessary.
  std::string NameLater(const std::string& stem);
  /// Adds a joint from X_PF on `from` to X_QM on `to`; the reference is valid until the next call.
  JointDescription& AddJoint(const std::string& name, JointType type, int from,
                             const Placement& X_PF, int to, const Placement& X_QM);
  /// Adds a joint that closes a loop; rejects one body on both sides.
  JointDescription& AddLoop(const XmlElement& element, const std::string& name, JointType type,
                            int from, const Placement& X_PF, int to, const Placement& X_QM);
  /// Adds a <drake:ball_constraint>: points of two bodies coincide. `body` and `point` read its
  /// children.
  void AddBall(const XmlElement& element, const std::function<int(const XmlElement&)>& body,
               const std::function<XmlValue(const XmlElement&)>& point);
  /// Adds the joint of a series between two bodies; X_PF is its frame on the parent.
  JointDescription& AddComposed(const std::string& name, const ComposedJoint& composed, int parent,
                                const Placement& X_PF, int child);
  /// Adds a weld of a body, named after it with this ending.
  void Fix(int parent, const Placement& X, int body, const char* ending);
  /// Adds spring and damper of the joint that was added last, where they are not 0.
  void AddSpringAndDamper(double stiffness, double rest, double damping);
  /// Adds the coupling sum_i ratio_i q_i = offset; a motion if one ratio is not 0. Dropped with a
  /// note unless all joints have one coordinate.
  void AddCoupling(const XmlElement& element, const std::string& name,
                   std::vector<CouplingDescription::Part> parts, double offset);
  /// Adds the coupling q_follower = ratio q_leader + offset.
  void AddFollower(const XmlElement& element, const std::string& name, int follower,
                   CouplingDescription::Part leader, double offset);
  /// Adds the coupling of a joint that follows another one by its description. Rejects cycles.
  void AddMimic(const XmlElement& element, int follower, CouplingDescription::Part leader,
                double offset);
  /// Returns the index of a joint from its name in the file, without `prefix`.
  int JointNamed(const XmlValue& value, const std::string& prefix = "") const;
  int last_joint() const { return static_cast<int>(description.joints.size()) - 1; }

  /// Calls `read` at the end, unless the body is fixed to the ground: its mass then has no effect.
  void ReadMassLater(int body, std::function<void()> read) {
    late_masses_.emplace_back(body, std::move(read));
  }
  /// Adds an upward force of `share` times its weight: gravity compensation.
  void AddLift(int body, double share) { lifts_.emplace_back(body, share); }

  /// Sets the default gravity of the format along -z [m/s^2].
  void AssumeGravity(const XmlElement& element, double gravity);

  /// Returns the numbers of a value by `kinds`: 'a' angle [rad], 'd' direction (3), 'q' quaternion
  /// (4), 'r' quaternion with scalar last, 'n' others. Makes rounded values exact with a note.
  std::vector<double> Numbers(const XmlValue& value, std::string_view kinds);
  /// Returns three numbers in the same way.
  Eigen::Vector3d Vector(const XmlValue& value, std::string_view kinds);

  void Note(const XmlElement& element, std::string reason, bool changes_motion = false) {
    Note(element, "", std::move(reason), changes_motion);
  }
  void Note(const XmlElement& element, const std::string& attribute, std::string reason,
            bool changes_motion = false);
  /// Adds a note of an attribute that is not there, a change of the motion.
  void Drop(const XmlElement& element, const std::string& attribute, std::string_view reason);
  /// Ignores an element with all its contents, with a note.
  void DropWhole(const XmlElement& element, std::string_view reason, bool changes_motion = false);
  /// Adds a note for each unread part.
  void NoteUnread(std::span<const DroppedReason> reasons);

  /// Completes the mechanism: sidecar, floating parts, merged fixed bodies, planar reduction.
  Imported Finish(const std::string& format);

 private:
  void NameJoints();
  void HoldFloatingParts();
  void ReadLateMasses() const;
  /// Merges bodies without valid own mass with bodies that they are welded to; with `whole`, merges
  /// all bodies that are fixed together with such a body.
  void MergeFixed(bool whole);
  /// Makes one joint of joints in series through bodies without mass where they form one, and gives
  /// mass to the other such bodies.
  void ComposeChains();
  void ReplaceChain(const MasslessChain& chain, const ComposedJoint& composed);
  /// Rejects joints of a placed chain that repeat motions of each other, unless they are
  /// `determined` without mass.
  void RejectRepeated(const MasslessChain& chain, const std::vector<bool>& determined) const;
  /// Gives mass to the bodies of a placed chain, with a note of its effect on the motion.
  void GiveMassToLinks(const MasslessChain& chain);
  /// Removes attached bodies (one entry per body) and the joints within their carriers.
  void Attach(const std::vector<Attachment>& attachments);
  /// Fixes bodies without mass at the ends of chains where they are drawn: their motion has no
  /// effect.
  void FixMasslessEnds();
  /// Returns true if a joint without load moves others through couplings.
  bool CouplesOthers(int joint) const;
  /// Rejects invalid masses and inertias of moving bodies, including their merged bodies; inertias
  /// that no body has are replaced if the options permit it.
  void CheckMasses();
  void MakeBallsPins(const Eigen::Vector3d& n);
  void GoToPlane();

  const XmlFile& file_;
  const ImportOptions& options_;
  std::vector<XmlElement> elements_;  ///< of bodies
  std::map<std::string, int> bodies_;
  exchange::UniqueNames joints_;                            ///< and couplings
  std::map<std::string, int> numbers_;                      ///< of joints with names
  std::map<int, int> leaders_;                              ///< of joints that follow others
  std::vector<std::pair<std::size_t, std::string>> stems_;  ///< for joints without names
  std::set<std::string> found_names_;                       ///< of these joints
  std::vector<ImportNote> notes_;
  std::set<std::pair<const void*, std::string>>
      rounded_;                   ///< elements and attributes of rounded values
  std::size_t rounded_note_ = 0;  ///< the note of the first
  std::vector<std::pair<int, double>> lifts_;
  std::vector<std::pair<int, std::function<void()>>> late_masses_;
  std::optional<XmlElement> assumed_gravity_;  ///< element that lacks the gravity
};

/// Returns q normalized; rejects zero, given by `value`.
Eigen::Quaterniond UnitQuaternion(const XmlValue& value, const Eigen::Quaterniond& q);

/// Read a format: fill the draft from the root element.
void ReadMjcf(const XmlElement& root, ImportDraft* draft);
void ReadUrdf(const XmlElement& root, const ImportOptions& options, ImportDraft* draft);
void ReadSdf(const XmlElement& root, ImportDraft* draft);
/// Reads joints of SDF in <gazebo> elements of a URDF robot, which close loops. The draft has all
/// bodies with their poses.
void ReadGazeboJoints(const XmlElement& robot, const std::vector<XmlElement>& joints,
                      ImportDraft* draft);

}  // namespace loopbench::harness
