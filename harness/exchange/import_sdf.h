// SDF (sdformat.org, versions 1.4 to 1.12): what its parts share.
//
// Internal to import_sdf*.cpp.
#pragma once

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "harness/exchange/import_draft.h"

namespace loopbench::harness {

/// Something with a pose: a link, joint, frame or nested model.
struct SdfFrame {
  XmlElement element;
  Placement raw;                 ///< as the file says it
  std::string relative_to;       ///< a name in the same scope; "" for the scope's own frame
  std::string attached_to;       ///< of a frame and of a joint: what it moves with
  bool is_raw_to_child = false;  ///< of a joint: raw is in the frame of its child
};

/// A world or a model: what it has by name, each in its own frame.
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
  /// Where the frame of that name is, in this scope's. `user` is who asks.
  Placement Resolve(const std::string& name, const XmlElement& user) const;
  /// The link that a link, frame or model moves with.
  Link LinkOf(const std::string& name, const XmlElement& user) const;
  bool is_world() const { return element.tag() != "model"; }

 private:
  // answers, so that a chain of frames is followed once
  mutable std::map<std::string, Placement> resolved_;
  mutable std::map<std::string, Link> links_;
};

struct SdfVersion {
  int minor = 0;  ///< of 1.x
};

/// <pose> of an element, and what it is relative to.
SdfFrame ReadSdfPose(const XmlElement& element, SdfVersion version, ImportDraft* draft);
/// A <joint> between links that are bodies already, with their numbers by full name.
void ReadSdfJoint(const XmlElement& element, const std::string& name, const SdfScope& scope,
                  SdfVersion version, ImportDraft* draft);
/// <inertial>, and what else a link says about itself.
void ReadSdfLink(const XmlElement& element, int body, bool is_static, SdfVersion version,
                 ImportDraft* draft);

}  // namespace loopbench::harness
