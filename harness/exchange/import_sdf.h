// Names and frames of SDF.
#pragma once

#include "harness/exchange/import_draft.h"

namespace loopbench::harness {

inline constexpr const char* kWorld = "world";
inline constexpr std::string_view kWithin = "::";  ///< between the names of a model and its part

/// An element with a pose: a link, joint, frame or nested model.
struct SdfFrame {
  XmlElement element;
  Placement raw = {};            ///< as given in the file
  std::string relative_to = "";  ///< a name in the same scope; "" for the scope's own frame
  std::string attached_to = "";  ///< for frames and joints: the name that they move with
  bool is_raw_to_child = false;  ///< for joints: raw is in the frame of the child
};

/// A world, a model or a URDF robot: its named elements, each in its own frame.
struct SdfScope {
  XmlElement element;
  ImportDraft* draft;
  int minor;                ///< of version 1.x
  std::string prefix = "";  ///< of names of bodies and joints: "arm::"
  bool is_static = false;
  std::map<std::string, SdfFrame> frames = {};
  std::vector<XmlElement> joints = {};
  std::map<std::string, std::unique_ptr<SdfScope>> models = {};  ///< nested; each has a frame too
  Placement at_rest = {};                                        ///< in ground axes

  /// A link's scope and its name there; no scope for the world.
  using Link = std::pair<const SdfScope*, std::string>;
  // results, so that a chain of frames is followed once
  mutable std::map<std::string, Placement> resolved_poses = {};
  mutable std::map<std::string, Link> resolved_links = {};

  bool is_urdf() const { return element.tag() == "robot"; }
  /// Returns the name of a joint's frame. Before 1.7, links may have the names of joints.
  std::string FrameOf(const std::string& joint) const {
    return minor < 7 ? "joint " + joint : joint;
  }
  /// Refuses a name that is in use here.
  void Add(const std::string& name, SdfFrame frame) {
    const auto [known, is_new] = frames.emplace(name, frame);
    if (is_new) return;
    frame.element.Fail(
        fmt::format("a second \"{}\"", name),
        fmt::format("a name that is not in use (line {} has it)", known->second.element.line()));
  }
  bool is_world() const { return element.tag() != "model"; }
  bool IsOwn(const std::string& name) const {
    return name.empty() || name == "__model__" || (is_world() && name == kWorld);
  }
  const SdfFrame& FrameNamed(const std::string& name, const XmlElement& user) const {
    const auto found = frames.find(name);
    if (found != frames.end()) return found->second;
    user.Fail(fmt::format("the frame \"{}\", which is not there", name),
              "a link, joint, frame or nested model of the same model");
  }
  /// Splits "arm::hand" into the model "arm" and the name "hand".
  const SdfScope* NestedScope(const std::string& name, std::string* rest) const {
    const std::size_t cut = name.find(kWithin);
    if (cut == std::string::npos) return nullptr;
    const auto found = models.find(name.substr(0, cut));
    if (found == models.end()) return nullptr;
    *rest = name.substr(cut + kWithin.size());
    return found->second.get();
  }
  /// Returns the pose of a frame in this scope's frame. `user`: the referring element.
  Placement Resolve(const std::string& name, const XmlElement& user) const;
  /// Returns the link that a link, frame or model moves with.
  Link LinkOf(const std::string& name, const XmlElement& user) const;
};

/// Reads the <pose> of an element and its `relative_to`.
SdfFrame ReadPose(const XmlElement& element, const SdfScope& scope);
/// Returns the pose of a part in its link. <inertial> has no other frames.
Placement PoseInLink(const XmlElement& part, const XmlElement& link, const SdfScope& scope);
/// Reads the name and frame of a link, frame or joint.
void ReadName(const XmlElement& child, SdfScope* scope);
/// Reads all names of a world or model, including nested models.
void ReadNames(SdfScope* scope);
/// Rejects models in other files.
void RefuseIncludes(const XmlElement& element);

}  // namespace loopbench::harness
