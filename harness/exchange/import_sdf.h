// SDF: scopes of names, and the reader (import_sdf.cpp; joints in import_sdf_joints.cpp).
#pragma once

#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "harness/exchange/import_draft.h"

namespace loopbench::harness {

inline constexpr const char* kSdfWorld = "world";

/// An element with a pose: a link, joint, frame or nested model.
struct SdfFrame {
  XmlElement element;
  Placement raw = {};            ///< as given in the file
  std::string relative_to = "";  ///< a name in the same scope; "" for the scope's own frame
  std::string attached_to = "";  ///< for frames and joints: the name that they move with
  bool is_raw_to_child = false;  ///< for joints: raw is in the frame of the child
};

/// A world, a model or a URDF robot: its named elements, each in its own frame.
class SdfScope {
 public:
  SdfScope(XmlElement element_, std::string prefix_, bool is_static_)
      : element(std::move(element_)), prefix(std::move(prefix_)), is_static(is_static_) {}

  XmlElement element;
  std::string prefix;  ///< of names of bodies and joints: "arm::"
  bool is_static;
  std::map<std::string, SdfFrame> frames;
  std::map<std::string, std::unique_ptr<SdfScope>> models;  ///< nested; each has a frame too
  Placement at_rest;                                        ///< in ground axes

  /// A link's scope and its name there; no scope for the world.
  using Link = std::pair<const SdfScope*, std::string>;

  /// Refuses a name that is in use here.
  void Add(const std::string& name, SdfFrame frame);
  /// Returns the pose of a frame in this scope's frame. `user`: the referring element.
  Placement Resolve(const std::string& name, const XmlElement& user) const;
  /// Returns the link that a link, frame or model moves with.
  Link LinkOf(const std::string& name, const XmlElement& user) const;

 private:
  bool is_world() const { return element.tag() != "model"; }
  bool IsOwn(const std::string& name) const {
    return name.empty() || name == "__model__" || (is_world() && name == kSdfWorld);
  }
  const SdfFrame& FrameNamed(const std::string& name, const XmlElement& user) const;
  /// Splits "arm::hand" into the model "arm" and the name "hand".
  const SdfScope* NestedScope(const std::string& name, std::string* rest) const;

  // results, so that a chain of frames is followed once
  mutable std::map<std::string, Placement> resolved_;
  mutable std::map<std::string, Link> links_;
};

class SdfReader {
 public:
  explicit SdfReader(ImportDraft* draft) : draft_(draft) {}

  void Read(const XmlElement& root);
  /// See ReadGazeboJoints().
  void ReadGazebo(const XmlElement& robot, const std::vector<XmlElement>& joints);

 private:
  /// The body that a parent or child moves with, and its pose in ground axes.
  struct End {
    int body = kGround;
    Placement at_rest;
  };
  /// An element that couples joints, read after all joints.
  struct Coupling {
    XmlElement element;
    const SdfScope* scope;
    int follower = -1;
  };

  void ReadVersion(const XmlValue& value);
  /// Reads the <pose> of an element and its `relative_to`.
  SdfFrame ReadPose(const XmlElement& element) const;
  /// Returns the name of a joint's frame. Before 1.7 joints are no frames, and links may have their
  /// names.
  std::string FrameOf(const std::string& joint) const {
    return minor_ < 7 ? "joint " + joint : joint;
  }
  /// Reads the name and frame of a link, frame or joint.
  void ReadName(const XmlElement& child, SdfScope* scope) const;
  /// Reads all names of a world or model, including nested models.
  void ReadNames(SdfScope* scope) const;
  /// Sets poses of models and links, and adds links as bodies.
  void ReadLinks(SdfScope* scope) const;
  /// Reads <inertial> and the other properties of a link.
  void ReadLink(const XmlElement& element, int index, bool is_static) const;
  /// Computes the mass of a link from its collision shapes.
  void ReadShapes(const XmlElement& element, const XmlElement& inertial, int index) const;

  // import_sdf_joints.cpp
  void ReadJoints(const SdfScope& scope);
  /// Reads a <joint> between links that are bodies already.
  void ReadJoint(const XmlElement& element, const SdfScope& scope);
  End EndOf(const XmlElement& side, const SdfScope& scope) const;
  /// Returns the axis in the joint's frame; before 1.5 it was given in the model's frame.
  Eigen::Vector3d ReadAxis(const XmlElement& axis, const SdfScope& scope,
                           const Placement& X_model_joint) const;
  /// Reads spring and damper of one axis; `has_one`: the joint has only this axis.
  void ReadDynamics(const XmlElement& axis, bool has_one) const;
  void NoteLimits(const XmlElement& axis) const;
  /// Sets the start of a joint: a coordinate for each of its own axes, 0 by default.
  void ReadStart(const std::vector<XmlElement>& axes, std::size_t num_own) const;
  void ReadCouplings();
  void ReadMimic(const Coupling& coupling) const;
  void ReadGearbox(const XmlElement& element, const SdfScope& scope) const;
  /// Returns the joint whose coordinate is the angle of a body from the reference body about an
  /// axis in ground axes, and their ratio, 1 or -1.
  CouplingDescription::Part TurnOf(const XmlElement& side, const SdfScope& scope,
                                   const Eigen::Vector3d& axis, int reference) const;

  ImportDraft* draft_;
  int minor_ = 0;         ///< of version 1.x
  bool is_urdf_ = false;  ///< the joints of a URDF robot
  std::vector<Coupling> mimics_, gearboxes_;
  std::vector<int> groups_;                        ///< of bodies that are fixed together
  std::multimap<std::pair<int, int>, int> turns_;  ///< hinges and screws, by groups
};

}  // namespace loopbench::harness
