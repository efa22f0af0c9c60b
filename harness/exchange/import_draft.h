// A mechanism during its import: poses, planar reduction, exact values. The importer files rely on
// the includes of this header.
#pragma once

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <cmath>
#include <functional>
#include <map>
#include <numbers>
#include <set>
#include <span>
#include <tuple>

#include "harness/base/text.h"
#include "harness/exchange/export_names.h"
#include "harness/exchange/import.h"
#include "harness/exchange/xml_document.h"
#include "mechanism/simplify/attach.h"

namespace loopbench::harness {

inline constexpr double kDegree = std::numbers::pi / 180.0;  ///< [rad]

/// Pose of a frame in another one. Its orientation is a quaternion, so that a rotation about one
/// axis stays exactly about that axis.
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

/// A frame on a body.
struct FrameOn {
  int body = kGround;
  Placement X;
};

/// Returns the rotation vector of a unit quaternion, at most half a turn [rad].
inline Eigen::Vector3d RotationVector(const Eigen::Quaterniond& q) {
  const double sine = q.vec().norm();
  if (sine == 0.0) return Eigen::Vector3d::Zero();
  const double angle = 2.0 * std::atan2(sine, std::abs(q.w()));
  return (q.w() < 0.0 ? -angle : angle) / sine * q.vec();
}

/// Returns the rotation about an axis: 0 for x to 2 for z.
inline Eigen::Quaterniond About(int axis, double angle) {
  Eigen::Quaterniond q(std::cos(0.5 * angle), 0.0, 0.0, 0.0);
  q.vec()[axis] = std::sin(0.5 * angle);
  return q;
}

/// Returns Rz(yaw) Ry(pitch) Rx(roll): the fixed-axes angles of URDF and SDF [rad].
inline Eigen::Quaterniond FromRollPitchYaw(const Eigen::Vector3d& angles) {
  return About(2, angles.z()) * About(1, angles.y()) * About(0, angles.x());
}

/// Returns successive rotations: 'x', 'y', 'z' about body-fixed axes, 'X', 'Y', 'Z' about
/// space-fixed axes (MJCF's eulerseq) [rad].
Eigen::Quaterniond FromEuler(const std::string& sequence, const Eigen::Vector3d& angles);

/// Returns the rotation onto perpendicular axes of unit length.
inline Eigen::Quaterniond FromAxes(const Eigen::Vector3d& x, const Eigen::Vector3d& y,
                                   const Eigen::Vector3d& z) {
  return Eigen::Quaterniond((Eigen::Matrix3d() << x, y, z).finished());
}

/// Returns the shortest rotation from z to `to`; for -z half a turn about x, as in MuJoCo.
Eigen::Quaterniond TurnOfZ(const Eigen::Vector3d& to);

/// Converts an inertia from axes B to A; q is R_AB. Bit-identical if the axes are parallel.
inline Eigen::Matrix3d InTurnedAxes(const Eigen::Quaterniond& q, const Eigen::Matrix3d& inertia) {
  if (q.vec().isZero(0.0)) return inertia;
  const Eigen::Matrix3d R = q.toRotationMatrix();
  const Eigen::Matrix3d turned = R * inertia * R.transpose();
  return 0.5 * (turned + turned.transpose());
}

/// Returns the symmetric matrix with elements xx, yy, zz, xy, xz, yz.
inline Eigen::Matrix3d SymmetricMatrix(double xx, double yy, double zz, double xy, double xz,
                                       double yz) {
  return Eigen::Matrix3d{{xx, xy, xz}, {xy, yy, yz}, {xz, yz, zz}};
}

/// Returns true, after replacing all three principal moments by their mean, if one is larger than
/// the sum of the others; as MuJoCo's balanceinertia.
bool Balance(Eigen::Matrix3d* inertia);

/// Returns the inertia from its elements: get("ixx" to "iyz", whether it is a moment).
template <class Get>
Eigen::Matrix3d InertiaOf(const Get& get) {
  return SymmetricMatrix(get("ixx", true), get("iyy", true), get("izz", true), get("ixy", false),
                         get("ixz", false), get("iyz", false));
}

/// Joints and loads of each body.
struct BodyLoads {
  explicit BodyLoads(const MechanismDescription& d);

  std::vector<std::vector<int>> joints;  ///< joints of each body
  std::vector<bool> has_load;            ///< a mass, an inertia or a force at a point
};
/// Returns the body on the other side of a joint.
inline int Beyond(const JointDescription& joint, int body) {
  return joint.from.body == body ? joint.to.body : joint.from.body;
}
/// Returns, for each body, the first body that is fixed to it; Ground for those fixed to Ground.
std::vector<int> FixedTogether(const MechanismDescription& description);

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
inline constexpr const char* kNoRotors = "only joints with one coordinate have rotors";
inline constexpr const char* kNeedsOneCoordinate = "only joints with one coordinate have forces";
inline constexpr const char* kNotCoupled =
    "dropped: only joints with one coordinate follow others: this is a freedom more than in the "
    "file";
inline constexpr const char* kDrakeBall = "drake:ball_constraint";
inline constexpr const char* kNoEnds = "joints turn and slide without ends";

/// Returns the entry of a name; otherwise rejects the value with `expected` and the nearest name.
template <class Entry>
const Entry& Named(const std::map<std::string, Entry>& entries, const std::string& name,
                   const XmlValue& value, std::string_view expected) {
  const auto found = entries.find(name);
  if (found != entries.end()) return found->second;
  std::vector<std::string> names;
  for (const auto& [known, entry] : entries) names.push_back(known);
  const std::string nearest = NearestSpelling(name, names);
  const std::string cure = nearest.empty() ? "" : fmt::format(" (did you mean \"{}\"?)", nearest);
  value.Fail(std::string(expected) + cure);
}

// Joints in series without mass between them (import_chains.cpp).

/// A joint of a series, in the drawn axes of the last body.
struct SerialJoint {
  JointType type = JointType::kRevolute;               ///< or prismatic, spherical, free
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  ///< [m]
  Eigen::Vector3d axis = Eigen::Vector3d::UnitZ();     ///< of unit length
  double reference = 0.0;                              ///< its coordinate in the drawn position
  bool leads_out = true;                               ///< from the inner body to the outer one
  Eigen::Quaterniond q_CJ = Eigen::Quaterniond::Identity();  ///< its frame in the drawn axes

  int num_q() const { return NumValues(type, SpaceKind::kSpatial, false); }
  int num_u() const { return NumValues(type, SpaceKind::kSpatial, true); }
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

/// A mechanism during its import in any format: readers fill it, and Finish() completes it.
class ImportDraft {
 public:
  ImportDraft(const XmlElement& root, const ImportOptions& options);

  MechanismDescription description;
  bool has_replicas = false;       ///< elements are read repeatedly: equal notes count once
  std::vector<Placement> at_rest;  ///< poses of bodies in ground axes at zero coordinates
  int base = kGround;  ///< the body of its part that gets a free joint; by default the first one

  /// Adds a body without mass; "" is replaced by the next free number. Rejects a name in use.
  int AddBody(const XmlElement& element, const std::string& name);
  /// Adds a link without mass between joints of a body. References do not find it.
  int AddLink(const XmlElement& element, int body) {
    description.bodies.emplace_back().name = description.bodies[body].name + " link";
    at_rest.push_back(Placement(at_rest[body]));
    elements_.push_back(element);
    return static_cast<int>(description.bodies.size()) - 1;
  }
  /// Adds a name of Ground, in place of a body of this name.
  void NameGround(const std::string& name) { bodies_[name] = kGround; }
  /// Returns the index of an existing body; a failure shows the value as in the file.
  int BodyNamed(const std::string& name, const XmlValue& user) const {
    return Named(bodies_, name, user, "the name of a body in this file");
  }
  /// Sets mass, centre of mass and inertia about it.
  void SetMass(int body, double mass, const Eigen::Vector3d& com, const Eigen::Matrix3d& inertia) {
    BodyDescription& made = description.bodies[body];
    std::tie(made.mass, made.com, made.inertia) = std::tie(mass, com, inertia);
  }
  /// Returns the element of a body; the root element for Ground.
  const XmlElement& element(int body) const { return elements_[body]; }

  /// Returns the name of a new joint; rejects a name in use.
  std::string NewJointName(const XmlElement& element, const std::string& name) {
    if (joints_.Add(name)) return name;
    element.Fail(fmt::format("a second joint \"{}\"", name), "a name that is not in use");
  }
  /// Returns "" for an unnamed joint that is added next. After all joints are read it is called
  /// `stem`, with a suffix if necessary.
  std::string NameLater(const std::string& stem) {
    stems_.emplace_back(description.joints.size(), stem);
    return "";
  }
  /// Adds a joint between frames; the reference is valid until the next call.
  JointDescription& AddJoint(const std::string& name, JointType type, const FrameOn& F,
                             const FrameOn& M);
  /// Adds a joint that closes a loop; rejects one body on both sides.
  JointDescription& AddLoop(const XmlElement& element, const std::string& name, JointType type,
                            const FrameOn& F, const FrameOn& M) {
    if (F.body == M.body) element.Fail("one body twice", "two different bodies");
    JointDescription& joint = AddJoint(name, type, F, M);
    joint.cut = true;
    return joint;
  }
  /// Adds a <drake:ball_constraint>: points of two bodies coincide. `body` and `point` read its
  /// children.
  void AddBall(const XmlElement& element, const std::function<int(const XmlElement&)>& body,
               const std::function<XmlValue(const XmlElement&)>& point);
  /// Adds a weld of a body, named after it with this ending.
  void Fix(int parent, const Placement& X, int body, const char* ending) {
    const std::string name = description.bodies[body].name + ending;
    AddJoint(NameLater(name), JointType::kWeld, {parent, X}, {body, {}});
  }
  /// Adds spring and damper of the joint that was added last, where they are not 0.
  void AddSpringAndDamper(double stiffness, double rest, double damping) {
    if (stiffness > 0.0) {
      description.forces.emplace_back(JointSpring{last_joint(), stiffness, rest, 0.0});
    }
    if (damping > 0.0) description.forces.emplace_back(JointDamper{last_joint(), damping});
  }
  /// Adds the coupling sum_i ratio_i q_i = offset; a motion if one ratio is not 0. Returns
  /// false if it is dropped with a note: a joint has several coordinates, or all ratios are 0.
  bool AddCoupling(const XmlElement& element, const std::string& name,
                   std::vector<CouplingDescription::Part> parts, double offset);
  /// Adds the coupling q_follower = ratio q_leader + offset.
  void AddFollower(const XmlElement& element, const std::string& name, int follower,
                   CouplingDescription::Part leader, double offset) {
    if (follower == leader.joint) {
      element.Fail("a joint that follows itself", "another joint");
    }
    AddCoupling(element, name, {{follower, 1.0}, {leader.joint, -leader.ratio}}, offset);
  }
  /// Adds the coupling of a joint that follows another one by its description. Rejects cycles.
  void AddMimic(const XmlElement& element, int follower, CouplingDescription::Part leader,
                double offset);
  /// Returns the index of a joint from its name in the file, without `prefix`.
  int JointNamed(const XmlValue& value, const std::string& prefix = "") const {
    return Named(numbers_, prefix + value.Name(), value, "the name of a joint in this file");
  }
  int last_joint() const { return static_cast<int>(description.joints.size()) - 1; }

  /// Calls `read` at the end, unless the body is fixed to the ground: its mass then has no effect.
  void ReadMassLater(int body, std::function<void()> read) {
    late_masses_.emplace_back(body, std::move(read));
  }
  /// Adds an upward force of `share` times its weight: gravity compensation.
  void AddLift(int body, double share) { lifts_.emplace_back(body, share); }

  /// Sets the default gravity of the format along -z [m/s^2].
  void AssumeGravity(const XmlElement& element, double gravity) {
    description.gravity = {0.0, 0.0, -gravity};
    assumed_gravity_ = element;
  }

  /// Returns the numbers of a value by `kinds`: 'a' angle [rad], 'd' direction (3), 'q' quaternion
  /// (4), 'r' quaternion with scalar last, 'n' others. Makes rounded values exact with a note.
  std::vector<double> Numbers(const XmlValue& value, std::string_view kinds);
  /// Returns three numbers in the same way.
  Eigen::Vector3d Vector(const XmlValue& value, std::string_view kinds) {
    return Eigen::Vector3d(Numbers(value, kinds).data());
  }

  void Note(const XmlElement& element, std::string reason, bool changes_motion = false) {
    Note(element, "", std::move(reason), changes_motion);
  }
  void Note(const XmlElement& element, const std::string& attribute, std::string reason,
            bool changes_motion = false) {
    const std::string shown = element.Shown() + (attribute.empty() ? "" : " ") + attribute;
    notes_.push_back(
        {element.file().name, element.line(), shown, std::move(reason), changes_motion});
  }
  /// Adds a note of an attribute that is not there, a change of the motion.
  void Drop(const XmlElement& element, const std::string& attribute, std::string_view reason) {
    Note(element, attribute, fmt::format("dropped: {}", reason), true);
  }
  /// Ignores an element with all its contents, with a note.
  void DropWhole(const XmlElement& element, std::string_view reason, bool changes_motion = false) {
    element.Ignore();
    Note(element, fmt::format("dropped: {}", reason), changes_motion);
  }
  /// Adds a note for each unread part.
  void NoteUnread(std::span<const DroppedReason> reasons);

  /// Completes the mechanism: sidecar, floating parts, merged fixed bodies, planar reduction.
  Imported Finish(const std::string& format);

 private:
  void NameJoints();
  void HoldFloatingParts();
  /// Merges bodies without valid own mass with bodies that they are welded to; with `whole`, merges
  /// all bodies that are fixed together with such a body.
  void MergeFixed(bool whole);
  /// Makes one joint of joints in series through bodies without mass, or gives these bodies mass.
  void ComposeChains();
  void ReplaceChain(const MasslessChain& chain, const ComposedJoint& composed);
  /// Rejects joints of a placed chain that repeat motions, unless `determined` without mass.
  void RejectRepeated(const MasslessChain& chain, const std::vector<bool>& determined) const;
  /// Gives mass to the bodies of a placed chain, with a note of its effect on the motion.
  void GiveMassToLinks(const MasslessChain& chain);
  /// Removes attached bodies (one entry per body) and the joints within their carriers.
  void Attach(const std::vector<Attachment>& attachments);
  /// Fixes bodies without mass at the ends of chains: their motion has no effect.
  void FixMasslessEnds();
  /// Returns true if a joint without load moves others through couplings.
  bool CouplesOthers(int joint) const;
  /// Rejects invalid masses and inertias of moving bodies, including their merged bodies; inertias
  /// that no body has are replaced if the options permit it.
  void CheckMasses();
  void MakeBallsPins(const Eigen::Vector3d& n);
  void GoToPlane();

  /// Returns the name of the main file.
  const std::string& file() const { return element(kGround).file().name; }

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
inline Eigen::Quaterniond UnitQuaternion(const XmlValue& value, const Eigen::Quaterniond& q) {
  const double length = q.norm();
  if (!(length > 0.0 && std::isfinite(length))) {
    value.Fail("a quaternion of finite length that is not zero");
  }
  return q.normalized();
}

/// Starts followers where their leaders place them. Leaders keep their start, by default zero.
void PlaceFollowers(ImportDraft* draft);
/// Read a format: fill the draft from the root element.
void ReadMjcf(const XmlElement& root, ImportDraft* draft);
void ReadUrdf(const XmlElement& root, const ImportOptions& options, ImportDraft* draft);
void ReadSdf(const XmlElement& root, ImportDraft* draft);
/// Reads joints of SDF in <gazebo> elements of a URDF robot, whose bodies the draft has.
void ReadGazeboJoints(const XmlElement& robot, const std::vector<XmlElement>& joints,
                      ImportDraft* draft);

}  // namespace loopbench::harness
