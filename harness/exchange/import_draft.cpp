#include "harness/exchange/import_draft.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace loopbench::harness {

Eigen::Quaterniond UnitQuaternion(const XmlValue& value, const Eigen::Quaterniond& q) {
  const double length = q.norm();
  if (!(length > 0.0 && std::isfinite(length))) {
    value.Fail("a quaternion of finite length that is not zero");
  }
  return q.normalized();
}

ImportDraft::ImportDraft(const XmlFile& file, const ImportOptions& options)
    : at_rest(1), file_(file), options_(options), elements_{file.root()}, lines_{0} {
  description.space = SpaceKind::kSpatial;
  description.bodies[kGround].name = "ground";
}

int ImportDraft::AddBody(const XmlElement& element, const std::string& name) {
  const int index = static_cast<int>(description.bodies.size());
  BodyDescription body;
  body.name = name.empty() ? fmt::format("body{}", index) : name;
  if (name.empty()) {
    while (bodies_.contains(body.name)) body.name += "_";
  } else if (const auto known = bodies_.find(name); known != bodies_.end()) {
    element.Fail("a second body of this name",
                 fmt::format("one that is not in use (line {} has it)", LineOf(known->second)));
  }
  bodies_.emplace(body.name, index);
  if (body.name == description.bodies[kGround].name) {
    body.name += "_";
    while (bodies_.contains(body.name)) body.name += "_";
    Note(element, fmt::format("called \"{}\": \"ground\" is what does not move", body.name));
    bodies_.emplace(body.name, index);
  }
  description.bodies.push_back(body);
  at_rest.emplace_back();
  elements_.push_back(element);
  lines_.push_back(element.line());
  return index;
}

int ImportDraft::BodyNamed(const XmlValue& value, const std::set<std::string>& also) const {
  const std::string name = value.Name();
  if (also.contains(name)) return kGround;
  const auto found = bodies_.find(name);
  if (found == bodies_.end()) value.Fail("the name of a body in this file");
  return found->second;
}

int ImportDraft::BodyNamed(const std::string& name, const XmlElement& user) const {
  const auto found = bodies_.find(name);
  if (found == bodies_.end()) user.Fail('"' + name + '"', "the name of a body in this file");
  return found->second;
}

std::string ImportDraft::NewJointName(const XmlElement& element, const std::string& name) {
  if (!joints_.Add(name)) {
    element.Fail(fmt::format("a second joint \"{}\"", name), "a name that is not in use");
  }
  return name;
}

std::string ImportDraft::NameLater(const std::string& stem) {
  stems_.emplace_back(description.joints.size(), stem);
  return "";
}

void ImportDraft::NameJoints() {
  for (const auto& [joint, stem] : stems_) {
    description.joints[joint].name = joints_.Take(stem);
  }
  stems_.clear();
}

JointDescription& ImportDraft::AddJoint(const std::string& name, JointType type, int from,
                                        const Placement& X_PF, int to, const Placement& X_QM) {
  JointDescription joint;
  joint.name = name;
  joint.type = type;
  joint.from = {from, X_PF.p, RotationVector(X_PF.q)};
  joint.to = {to, X_QM.p, RotationVector(X_QM.q)};
  description.joints.push_back(joint);
  return description.joints.back();
}

void ImportDraft::AddLift(int body, double share) { lifts_.emplace_back(body, share); }

void ImportDraft::AssumeGravity(const XmlElement& element, double gravity) {
  description.gravity = {0.0, 0.0, -gravity};
  assumed_gravity_ = element;
}

void ImportDraft::Note(const XmlElement& element, std::string reason, bool changes_motion) {
  notes_.push_back({element.line(), element.Shown(), std::move(reason), changes_motion});
}

void ImportDraft::Note(const XmlElement& element, const std::string& attribute, std::string reason,
                       bool changes_motion) {
  std::string shown = element.Shown();
  if (!attribute.empty()) shown += " " + attribute;
  notes_.push_back({element.line(), std::move(shown), std::move(reason), changes_motion});
}

void ImportDraft::NoteUnread(std::span<const DroppedReason> reasons) {
  file_.Unread([&](const XmlElement& element, const std::string& attribute) {
    const auto find = [&](const std::string& what) {
      return std::ranges::find(reasons, what, &DroppedReason::what);
    };
    if (element.tag().starts_with("xacro:")) {
      element.Fail("an element of xacro", "plain XML, as `xacro FILE` writes it");
    }
    if (attribute.starts_with("xmlns")) return;
    auto known = reasons.end();
    if (attribute.empty()) {
      known = find(element.tag());
    } else {
      known = find(element.tag() + "@" + attribute);
      if (known == reasons.end()) known = find("@" + attribute);
    }
    if (known == reasons.end()) {
      Note(element, attribute, "dropped: not known to this reader", true);
    } else if (!known->reason.empty()) {
      Note(element, attribute, fmt::format("dropped: {}", known->reason), known->changes_motion);
    }
  });
}

}  // namespace loopbench::harness
