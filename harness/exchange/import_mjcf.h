// MJCF, the format of MuJoCo (mujoco.readthedocs.io, "XML reference"): what its parts share.
//
// Internal to import_mjcf*.cpp.
#pragma once

#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "harness/exchange/import_draft.h"

namespace loopbench::harness {

/// Why springs, dampers and efforts of a joint of several coordinates are dropped.
inline constexpr const char* kNeedsOneCoordinate = "only joints with one coordinate have forces";

/// What limits the efforts of all actuators of a joint.
inline constexpr const char *kEffortFlag = "actuatorfrclimited", *kEffortRange = "actuatorfrcrange";

/// An element with what its classes say where it is silent: itself first, then the nearest class.
class MjcfElement {
 public:
  MjcfElement(XmlElement own, std::vector<XmlElement> classes)
      : own_(std::move(own)), classes_(std::move(classes)) {}

  const XmlElement& own() const { return own_; }
  std::optional<XmlValue> Attribute(const std::string& name) const;
  double Number(const std::string& name, double otherwise, const Range& range = {}) const;
  /// Itself and its classes, nearest first.
  std::vector<XmlElement> Layers() const;

 private:
  XmlElement own_;
  std::vector<XmlElement> classes_;
};

/// <default> and the classes nested in it. The class at the top is "main", which elements without
/// a class have; it may have another name too.
class MjcfDefaults {
 public:
  void Read(const XmlElement& element, const std::string& parent);
  /// `childclass`: of the bodies around the element; `tag`: that of its defaults, if it is not its
  /// own.
  MjcfElement Of(const XmlElement& element, const std::string& childclass,
                 const std::string& tag = "") const;
  /// The same, of an element that may be dropped yet: its classes do not count as in use.
  MjcfElement Peek(const XmlElement& element, const std::string& childclass,
                   const std::string& tag = "") const;
  /// Refuses a class that nobody has described.
  void CheckClass(const XmlValue& value) const;
  /// What no element took counts as read.
  void IgnoreUnused() const;

 private:
  struct Class {
    std::string parent;
    /// By what they describe: actuators of all tags have one default. In the order of the file.
    std::map<std::string, std::vector<XmlElement>> elements;
  };
  using Use = std::pair<std::string, std::string>;  ///< a class, and what it describes

  /// The name under which a class is described.
  std::string Known(const std::string& name) const;
  std::vector<XmlElement> Layers(const XmlElement& element, const std::string& childclass,
                                 const std::string& tag, std::set<Use>* used) const;

  std::map<std::string, Class> classes_;
  std::set<std::string> names_of_main_;
  mutable std::set<Use> used_;
};

/// Attributes of <compiler> and <option> that matter.
struct MjcfSettings {
  bool degrees = true;
  std::string euler = "xyz";
  enum { kFromInertial, kFromGeoms, kAuto } inertia = kAuto;
  bool balances_inertia = false, limits_by_range = true;
  double least_mass = 0.0, least_inertia = 0.0, total_mass = -1.0;
  int first_group = 0, last_group = 5;
  bool has_contact = true, has_equality = true, has_springs = true, has_dampers = true;
  bool has_actuation = true, clamps_controls = true;
  std::set<int> silent_groups;  ///< of actuators

  /// Springs, dampers, and gravity compensation while one of them acts.
  bool has_passive() const { return has_springs || has_dampers; }
  double Angle(double value) const { return degrees ? value * kDegree : value; }
};

enum class MjcfKind { kHinge, kSlide, kBall, kFree };

/// Least and largest value.
using MjcfLimits = std::pair<double, double>;

/// A joint of MuJoCo: with others on the same body it is part of one of ours.
struct MjcfJoint {
  explicit MjcfJoint(MjcfElement element_) : element(std::move(element_)) {}

  MjcfElement element;
  MjcfKind kind = MjcfKind::kHinge;
  std::string name;
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  ///< in body axes [m]
  Eigen::Vector3d axis = Eigen::Vector3d::UnitZ();     ///< of unit length
  double reference = 0.0;                              ///< its coordinate where the file draws it
  double spring_reference = 0.0;                       ///< and where its spring is free
  int joint = -1;                                      ///< ours that it became a part of
  bool alone = true;                                   ///< it is all of it

  int num_q() const { return kind == MjcfKind::kFree ? 7 : kind == MjcfKind::kBall ? 4 : 1; }
  int num_u() const { return kind == MjcfKind::kFree ? 6 : kind == MjcfKind::kBall ? 3 : 1; }
};

/// The joints of a body, from the outermost, and what they are for us.
struct MjcfChain {
  int parent = kGround, child = kGround;
  Placement X_PB;                  ///< where the file draws the body in its parent
  std::vector<std::size_t> parts;  ///< in MjcfModel::joints; none of a body that is fixed
  int joint = -1;
  bool from_is_child = false;  ///< ours leads from the child to its parent
  Placement X_BJ;              ///< our frame on the child, in its axes
};

class MjcfModel {
 public:
  explicit MjcfModel(ImportDraft* draft_) : draft(draft_) {}

  ImportDraft* draft;
  MjcfSettings settings;
  MjcfDefaults defaults;
  std::vector<MjcfJoint> joints;  ///< in the order of qpos
  std::vector<MjcfChain> chains;  ///< of all bodies, in that order
  std::map<std::string, BodyPoint> sites;
  std::map<std::string, std::size_t> joint_names;

  /// The orientation that the element says, in whichever way; the class's if it says none.
  Eigen::Quaterniond OrientationOf(const MjcfElement& element) const;
  Placement PlacementOf(const MjcfElement& element) const;
  /// What the element says in `range`, where `flag` or, without it, the range itself makes it
  /// count.
  std::optional<MjcfLimits> LimitsOf(const MjcfElement& element, const std::string& flag,
                                     const std::string& range) const;
  /// Notes that a joint or tendon is limited, with any range or none: limits are dropped.
  void NoteLimits(const MjcfElement& element, const char* reason) const;
  /// Bodies in ground axes where the springs of joints are free: tendons that do not say their
  /// free length are free there.
  std::vector<Placement> WhereSpringsAreFree() const;
  const BodyPoint& SiteNamed(const XmlValue& value) const;
  MjcfJoint& JointNamed(const XmlValue& value);
};

/// A geom of a body, its class, and the frame around it.
struct MjcfGeom {
  MjcfElement element;
  Placement X;
};

/// Mass, centre of mass and inertia of the geoms [kg, m, kg m^2], body axes.
struct MassProperties {
  double mass = 0.0;
  Eigen::Vector3d com = Eigen::Vector3d::Zero();
  Eigen::Matrix3d inertia = Eigen::Matrix3d::Zero();
};
/// Refuses meshes, whose files are not read, unless they count as nothing.
MassProperties MassOfGeoms(const MjcfModel& model, const std::vector<MjcfGeom>& geoms,
                           bool drops_meshes);

/// <worldbody>.
void ReadMjcfWorld(const XmlElement& world, MjcfModel* model);
/// Total mass, bounds: what <compiler> does to all bodies.
void AdjustMasses(MjcfModel* model);
/// A <joint> or <freejoint>, with its springs and dampers still unread; X is the frame around it in
/// its body.
MjcfJoint ReadMjcfJoint(const MjcfModel& model, const XmlElement& element, const Placement& X,
                        const std::string& childclass);
/// Makes one joint of ours of those of a body; X_PB is where the file draws the body.
void AddMjcfChain(MjcfModel* model, const XmlElement& body, int parent, int child,
                  const Placement& X_PB, const std::vector<MjcfJoint>& joints);
void ReadMjcfEquality(const XmlElement& section, MjcfModel* model);
/// Spatial tendons between two sites; `held`: names of tendons that keep their length, which become
/// rods.
void ReadMjcfTendons(const XmlElement& root, const std::map<std::string, XmlElement>& held,
                     MjcfModel* model);
void ReadMjcfKeys(const XmlElement& root, MjcfModel* model);
/// Constant efforts of actuators under these controls; without any, under 0.
void ReadMjcfActuators(const XmlElement& root, const std::optional<XmlValue>& controls,
                       MjcfModel* model);

}  // namespace loopbench::harness
