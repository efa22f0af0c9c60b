#include "harness/exchange/import_sdf.h"

namespace loopbench::harness {

Placement SdfScope::Resolve(const std::string& name, const XmlElement& user) const {
  // chain of relative frames, up to a known one
  std::vector<std::pair<std::string, Placement>> chain;
  Placement X;
  for (std::string here = name, next; !IsOwn(here); here = next) {
    if (const auto known = resolved_poses.find(here); known != resolved_poses.end()) {
      X = known->second;
      break;
    }
    // without a cycle, a chain has at most each frame and a name within each model
    if (chain.size() > 2 * frames.size()) {
      user.Fail("frames that are relative to each other", "no cycle");
    }
    std::string rest;
    if (const SdfScope* nested = NestedScope(here, &rest)) {
      chain.emplace_back(here, nested->Resolve(rest, user));
      next = here.substr(0, here.find(kWithin));
    } else {
      const SdfFrame& frame = FrameNamed(here, user);
      chain.emplace_back(here, frame.raw);
      next = frame.relative_to;
    }
  }
  for (auto link = chain.rbegin(); link != chain.rend(); ++link) {
    X = X * link->second;
    resolved_poses.emplace(link->first, X);
  }
  return X;
}

SdfScope::Link SdfScope::LinkOf(const std::string& name, const XmlElement& user) const {
  std::vector<std::string> chain;  // each attached to the next
  std::string here = name;
  std::optional<Link> link;
  while (!link) {
    if (const auto known = resolved_links.find(here); known != resolved_links.end()) {
      link = known->second;
      break;
    }
    if (chain.size() > frames.size() + 1) {
      user.Fail("frames that are attached to each other", "no cycle");
    }
    chain.push_back(here);
    std::string rest;
    if (const SdfScope* nested = NestedScope(here, &rest)) {
      link = nested->LinkOf(rest, user);
    } else if (IsOwn(here) && is_world()) {
      link = Link{nullptr, ""};
    } else if (IsOwn(here)) {
      // a model moves with its canonical link, by default the first one
      const auto canonical = element.Filled("canonical_link");
      const std::vector<XmlElement> links = element.Children({"link"});
      if (!canonical && links.empty()) {
        user.Fail(fmt::format("the model of \"{}\" without a link", name), "one");
      }
      here = canonical ? canonical->text() : links[0].RequiredName();
    } else {
      const SdfFrame& frame = FrameNamed(here, user);
      const std::string tag = frame.element.tag();
      if (tag == "link") link = Link{this, here};
      if (tag == "model") link = models.at(here)->LinkOf("", user);
      here = frame.attached_to;
    }
  }
  for (const std::string& attached : chain) resolved_links.emplace(attached, *link);
  return *link;
}

void RefuseIncludes(const XmlElement& element) {
  for (const XmlElement& include : element.Children({"include"})) {
    include.Fail("a model in another file", "all in one file (gz sdf -p FILE writes it)");
  }
}

SdfFrame ReadPose(const XmlElement& element, const SdfScope& scope) {
  SdfFrame frame{element};
  const auto pose = element.Child("pose");
  if (!pose) return frame;
  if (const auto old = pose->Filled("frame")) {
    old->Fail("none: what it means was said only from 1.7 on, as relative_to");
  }
  if (const auto relative = pose->Filled("relative_to")) {
    if (scope.minor < 7) relative->Fail("none before version 1.7");
    frame.relative_to = relative->Name();
  }
  const bool in_degrees = BoolOr(pose->Attribute("degrees"));
  const auto format = pose->Attribute("rotation_format");
  const bool quaternion =
      format && format->Choice<bool>({{"euler_rpy", false}, {"quat_xyzw", true}});
  const XmlValue content = pose->Content();
  if (content.text().empty()) return frame;
  const char* kinds = quaternion ? "nnnr" : in_degrees ? "nnnnnn" : "nnnaaa";
  const std::vector<double> p = scope.draft->Numbers(content, kinds);
  frame.raw.p = {p[0], p[1], p[2]};
  frame.raw.q = quaternion
                    ? UnitQuaternion(content, {p[6], p[3], p[4], p[5]})
                    : FromRollPitchYaw((in_degrees ? kDegree : 1.0) * Vector3d(p[3], p[4], p[5]));
  return frame;
}

Placement PoseInLink(const XmlElement& part, const XmlElement& link, const SdfScope& scope) {
  const SdfFrame pose = ReadPose(part, scope);
  const std::string own = link.RequiredName();
  if (pose.relative_to.empty() || pose.relative_to == own) return pose.raw;
  if (part.tag() == "inertial") {
    part.RequiredChild("pose").Required("relative_to", "").Fail("none, or its own link");
  }
  return scope.Resolve(own, part).Inverse() * scope.Resolve(pose.relative_to, part) * pose.raw;
}

void ReadName(const XmlElement& child, SdfScope* scope) {
  SdfFrame frame = ReadPose(child, *scope);
  const bool is_joint = child.tag() == "joint";
  if (is_joint) {
    const XmlValue moved = child.RequiredChild("child").Content();
    if (moved.Name() == kWorld) {
      moved.Fail("a link, frame or nested model: the world is no child, it can be the <parent>");
    }
    frame.attached_to = moved.text();
  } else if (child.tag() == "frame") {
    if (const auto attached = child.Attribute("attached_to")) frame.attached_to = attached->text();
  }
  if (frame.relative_to.empty()) {
    frame.relative_to = frame.attached_to;
    frame.is_raw_to_child = is_joint;
  }
  const std::string name = child.RequiredName();
  scope->Add(is_joint ? scope->FrameOf(name) : name, std::move(frame));
}

void ReadNames(SdfScope* scope) {
  const XmlElement& element = scope->element;
  RefuseIncludes(element);
  scope->joints = element.Children({"joint"});
  for (const char* tag : {"link", "frame", "joint"}) {
    for (const XmlElement& child : element.Children({tag})) ReadName(child, scope);
  }
  for (const XmlElement& child : element.Children({"model"})) {
    const std::string name = child.RequiredName();
    const bool is_fixed = BoolOr(child.Content("static"));
    const auto& model = scope->models[name] =
        std::make_unique<SdfScope>(SdfScope{.element = child,
                                            .draft = scope->draft,
                                            .minor = scope->minor,
                                            .prefix = scope->prefix + name + std::string(kWithin),
                                            .is_static = scope->is_static || is_fixed});
    ReadNames(model.get());
    SdfFrame frame = ReadPose(child, *scope);
    if (const auto placed = child.Filled("placement_frame")) {
      // the pose is the pose of this frame of the model
      frame.raw = frame.raw * model->Resolve(placed->Name(), child).Inverse();
    }
    scope->Add(name, std::move(frame));
  }
}

}  // namespace loopbench::harness
