// MJCF, the format of MuJoCo (mujoco.readthedocs.io, "XML reference"): common parts.
//
// Internal to import_mjcf*.cpp.
#pragma once

#include <deque>

#include "harness/exchange/solids.h"

namespace loopbench::harness {

/// Attributes that limit the efforts of all actuators of a joint.
inline constexpr const char *kEffortFlag = "actuatorfrclimited", *kEffortRange = "actuatorfrcrange";

/// <default> and its nested classes. The top class, which may be named, is "main", the usual one.
class MjcfDefaults {
 public:
  void Read(const XmlElement& element, const std::string& parent);
  /// Returns the element with its defaults. `childclass`: class of the enclosing bodies; `tag`: tag
  /// of its defaults, if different from its own; `uses`: its classes count as used, which is wrong
  /// for an element that may still be dropped.
  XmlElement Of(const XmlElement& element, const std::string& childclass,
                const std::string& tag = "", bool uses = true) const;
  /// Rejects an undefined class.
  void CheckClass(const XmlValue& value) const {
    const std::string name = Known(value.text());
    if (!classes_.contains(name) && name != kMain) value.Fail("a class described in <default>");
  }
  /// Marks unused defaults as read.
  void IgnoreUnused() const;

 private:
  struct Class {
    std::string parent;
    /// Defaults by element type, in file order: actuators of all tags have one default.
    std::map<std::string, std::vector<XmlElement>> elements;
  };
  static constexpr const char* kMain = "main";  ///< class of elements without one
  /// Returns the name under which a class is defined.
  std::string Known(const std::string& name) const {
    return names_of_main_.contains(name) ? kMain : name;
  }

  std::map<std::string, Class> classes_;
  std::set<std::string> names_of_main_;
  mutable std::set<std::pair<std::string, std::string>> used_;  ///< class, element type
};

/// Relevant attributes of <compiler> and <option>.
struct MjcfSettings {
  bool degrees = true;
  std::string euler = "xyz";
  enum Inertia { kFromInertial, kFromGeoms, kAuto } inertia = kAuto;
  bool balances_inertia = false, limits_by_range = true;
  bool has_exact_meshes = false;  ///< before MuJoCo 3.2.5
  bool aligns_free = false;       ///< frames of free bodies are their inertial frames
  double least_mass = 0.0, least_inertia = 0.0, total_mass = -1.0;
  int first_group = 0, last_group = 5;
  bool has_contact = true, has_equality = true, has_springs = true, has_dampers = true;
  bool has_actuation = true, clamps_controls = true, has_limits = true, has_friction = true;
  std::set<int> silent_groups;        ///< groups of disabled actuators
  std::filesystem::path mesh_folder;  ///< from the main file's folder

  /// True if springs or dampers act; gravity compensation acts only with them.
  bool has_passive() const { return has_springs || has_dampers; }
  double Angle(double value) const { return degrees ? value * kDegree : value; }
};

/// Minimum and maximum value.
using MjcfLimits = std::pair<double, double>;

struct MjcfJoint : SerialJoint {
  explicit MjcfJoint(XmlElement element_) : element(std::move(element_)) {}

  XmlElement element;
  std::string name;
  double spring_reference = 0.0;  ///< its coordinate with a relaxed spring
  std::vector<double> drawn;      ///< its part of qpos in the drawn position
  int joint = -1;                 ///< of the mechanism, until chains are composed
};

/// Frame of a body in MuJoCo, in the body: of a free body with `align` its inertial frame.
struct MjcfFrame {
  Placement X;
  bool has_axes = true;  ///< false: MuJoCo's axes are eigenvectors, X.q is the identity
};

/// One copy of the contents of a <replicate>, within a copy of each <replicate> around it.
struct MjcfReplica {
  const void* replicate = nullptr;  ///< identity of its element
  const MjcfReplica* around = nullptr;
  std::string suffix;  ///< of names: its own, then that of the replica around it
};

class MjcfModel {
 public:
  explicit MjcfModel(ImportDraft* draft_) : draft(draft_) {}

  ImportDraft* draft;
  MjcfSettings settings;
  MjcfDefaults defaults;
  std::vector<MjcfJoint> joints;  ///< in the order of qpos
  /// Poses of bodies in ground axes at relaxed joint springs, for default lengths of tendons.
  std::vector<Placement> where_springs_are_free = {Placement()};
  std::map<std::string, FrameOn> sites;
  std::map<std::string, XmlElement> meshes;
  mutable std::map<std::string, Solid> mesh_solids;  ///< of meshes that have been read
  std::map<std::string, std::size_t> joint_names;
  std::set<int> links;               ///< bodies without mass between joints of one body of MuJoCo
  std::map<int, MjcfFrame> aligned;  ///< by body
  std::vector<std::pair<int, double>> lifts;  ///< bodies and their `gravcomp`
  std::map<const void*, std::vector<const MjcfReplica*>>
      replicates;  ///< copies of each <replicate>

  /// Returns the next copy of the contents of a <replicate>; nullptr stands for no replica.
  const MjcfReplica* AddReplica(const XmlElement& element, const MjcfReplica* around,
                                const std::string& suffix);
  /// Counts an element that is read in a replica; rejects too many.
  void CountCopy(const XmlElement& element) {
    element.RequireFew(++num_copies_, 100000, "elements of replicas");
  }
  /// Returns a new name of this kind ("joint"), with the suffix of its replica.
  std::string NewName(const std::string& kind, const XmlValue& name, const MjcfReplica* replica) {
    if (replica == nullptr) return name.Name();
    replicated_.emplace(kind + " " + name.Name(), replica->replicate);
    return name.Name() + replica->suffix;
  }
  /// Returns the name that a reference stands for in the replica that is read at present.
  std::string NameOf(const std::string& kind, const XmlValue& reference) const;
  /// Returns the suffix of names in the replica that is read at present.
  std::string Suffix() const { return present_ == nullptr ? "" : present_->suffix; }
  using References = std::vector<std::pair<std::string, std::optional<XmlValue>>>;
  /// Calls `read` once, or for each replica of the innermost <replicate> that contains a name of
  /// `references`. Rejects names in different ones.
  void ForReplicas(const References& references, const std::function<void()>& read);

  /// Returns the orientation of the element in any notation; by default the one of its class.
  Eigen::Quaterniond OrientationOf(const XmlElement& element) const;
  Placement PlacementOf(const XmlElement& element) const {
    const Eigen::Vector3d p = VectorOr(element.Attribute("pos"));
    return {OrientationOf(element), p};
  }
  /// Returns the frame that MuJoCo gives to a body.
  MjcfFrame FrameOf(int body) const {
    const auto found = aligned.find(body);
    return found != aligned.end() ? found->second : MjcfFrame();
  }
  /// Moves position and axes of a site or geom to the line of its `fromto`. Returns the length.
  double PlaceAlong(const XmlValue& fromto, Placement* X) const;
  /// Returns the limits in `range`, if `flag` or, without it, the range itself makes them active.
  std::optional<MjcfLimits> LimitsOf(const XmlElement& element, const std::string& flag,
                                     const std::string& range) const;
  /// Notes that limits of a joint or tendon are dropped, with or without a range.
  void NoteLimits(const XmlElement& element, const char* reason) const {
    const auto flag = element.Attribute("limited"), range = element.Attribute("range");
    if (!settings.has_limits) return;
    if ((flag && flag->text() == "true") || LimitsOf(element, "limited", "range")) {
      draft->Drop(element, range ? "range" : "limited", reason);
    }
  }
  /// Notes that a nonzero number is dropped.
  void DropNonzero(const XmlElement& element, const char* name, const char* reason) const {
    if (element.Number(name, 0.0) != 0.0) draft->Drop(element, name, reason);
  }
  const FrameOn& SiteNamed(const XmlValue& value) const {
    return Named(sites, NameOf("site", value), value, "the name of a site");
  }
  std::size_t JointNamed(const XmlValue& value) const {
    return Named(joint_names, NameOf("joint", value), value, "the name of a joint");
  }
  int BodyNamed(const XmlValue& value) const {
    return value.text() == "world" ? kGround : draft->BodyNamed(NameOf("body", value), value);
  }

 private:
  std::deque<MjcfReplica> replicas_;
  std::map<std::string, const void*> replicated_;  ///< replicates by kind and name
  const MjcfReplica* present_ = nullptr;           ///< the replica that is read
  std::size_t num_copies_ = 0;
};

/// Resolves the elements that stand for other files, at most kMaxConfigBytes in all, or for copies:
///   <include file="...">: the children of the root element of that file, which is read once.
///   <attach model="..." body="..." prefix="...">: a body of a <model> in <asset>, or its whole
///   world; then its defaults, meshes, tendons, constraints and actuators, with prefixed names.
///   Without `model`: a copy of a body of the file itself, then of tendons and so on.
void IncludeMjcf(const XmlElement& root);
/// Reads <worldbody>.
void ReadMjcfWorld(const XmlElement& world, MjcfModel* model);
/// Applies the total mass and the bounds of <compiler> to all bodies.
void AdjustMasses(MjcfModel* model);
/// An element within a body, with its defaults, enclosing frame and the default class there.
struct MjcfPlaced {
  XmlElement element;
  Placement X;
  std::string childclass;
  const MjcfReplica* replica = nullptr;
};
/// Adds the joints of a body in series, with links between; X_PB is the drawn pose of the body.
void AddMjcfJoints(MjcfModel* model, const XmlElement& body, int parent, int child,
                   const Placement& X_PB, const std::vector<MjcfPlaced>& joints);
/// Reads constraints and tendons between two sites: springs, or rods if an <equality> fixes them.
void ReadMjcfLoops(const XmlElement& root, MjcfModel* model);
void ReadMjcfKeys(const XmlElement& root, MjcfModel* model);
/// Sets constant actuator efforts for these controls; by default all controls are 0.
void ReadMjcfActuators(const XmlElement& root, const std::optional<XmlValue>& controls,
                       MjcfModel* model);

}  // namespace loopbench::harness
