// Frames of SDF: who stands where, and what moves with what.
#include <fmt/format.h>

#include "harness/exchange/import_sdf.h"

namespace loopbench::harness {

namespace {

constexpr std::string_view kOwn = "__model__";
constexpr std::string_view kSdfWorld = "world";
constexpr std::string_view kWithin = "::";

bool IsOwn(const std::string& name, const SdfScope& scope) {
  return name.empty() || name == kOwn || (scope.is_world() && name == kSdfWorld);
}

[[noreturn]] void FailToFind(const std::string& name, const XmlElement& user) {
  user.Fail(fmt::format("the frame \"{}\", which is not there", name),
            "a link, joint, frame or nested model of the same model");
}

/// "arm::hand" as the model "arm" and "hand".
const SdfScope* NestedScope(const SdfScope& scope, const std::string& name, std::string* rest) {
  const std::size_t cut = name.find(kWithin);
  if (cut == std::string::npos) return nullptr;
  const auto found = scope.models.find(name.substr(0, cut));
  if (found == scope.models.end()) return nullptr;
  *rest = name.substr(cut + kWithin.size());
  return found->second.get();
}

}  // namespace

SdfFrame ReadSdfPose(const XmlElement& element, SdfVersion version) {
  SdfFrame frame{element, {}, "", ""};
  const auto pose = element.Child("pose");
  if (!pose) return frame;
  if (const auto old = pose->Attribute("frame"); old && !old->text().empty()) {
    old->Fail("none: what it means was said only from 1.7 on, as relative_to");
  }
  if (const auto relative = pose->Attribute("relative_to"); relative && !relative->text().empty()) {
    if (version.minor < 7) relative->Fail("none before version 1.7");
    frame.relative_to = relative->Name();
  }
  const auto degrees = pose->Attribute("degrees");
  const double unit = degrees && degrees->Bool() ? kDegree : 1.0;
  const auto format = pose->Attribute("rotation_format");
  const bool quaternion = format && format->Choice({"euler_rpy", "quat_xyzw"}) == 1;
  const XmlValue content = pose->Content();
  if (content.text().empty()) return frame;
  const std::size_t count = quaternion ? 7 : 6;
  const std::vector<double> p = content.Numbers(count, count);
  frame.raw.p = {p[0], p[1], p[2]};
  if (quaternion) {
    frame.raw.q = UnitQuaternion(content, {p[6], p[3], p[4], p[5]});
  } else {
    frame.raw.q = FromRollPitchYaw(unit * Eigen::Vector3d(p[3], p[4], p[5]));
  }
  return frame;
}

void SdfScope::Add(const std::string& name, SdfFrame frame) {
  const auto known = frames.find(name);
  if (known != frames.end()) {
    frame.element.Fail(
        fmt::format("a second \"{}\"", name),
        fmt::format("a name that is not in use (line {} has it)", known->second.element.line()));
  }
  frames.emplace(name, std::move(frame));
}

Placement SdfScope::Resolve(const std::string& name, const XmlElement& user) const {
  Placement X;
  std::string here = name;
  // no chain without a cycle is longer than all frames
  for (std::size_t steps = 0; !IsOwn(here, *this); ++steps) {
    if (steps > frames.size()) user.Fail("frames that are relative to each other", "no cycle");
    std::string rest;
    if (const SdfScope* nested = NestedScope(*this, here, &rest)) {
      X = nested->Resolve(rest, user) * X;
      here = here.substr(0, here.find(kWithin));
    }
    const auto found = frames.find(here);
    if (found == frames.end()) FailToFind(here, user);
    X = found->second.raw * X;
    here = found->second.relative_to;
  }
  return X;
}

std::pair<const SdfScope*, std::string> SdfScope::LinkOf(const std::string& name,
                                                         const XmlElement& user) const {
  std::string here = name;
  for (std::size_t steps = 0;; ++steps) {
    if (steps > frames.size()) user.Fail("frames that are attached to each other", "no cycle");
    std::string rest;
    if (const SdfScope* nested = NestedScope(*this, here, &rest)) return nested->LinkOf(rest, user);
    if (IsOwn(here, *this)) {
      if (is_world()) return {nullptr, ""};
      // a model moves with its canonical link, the first one unless it names another
      const auto canonical = element.Attribute("canonical_link");
      if (canonical && !canonical->text().empty()) {
        here = canonical->text();
        continue;
      }
      const std::vector<XmlElement> links = element.Children("link");
      if (links.empty()) user.Fail(fmt::format("the model of \"{}\" without a link", name), "one");
      here = links[0].Required("name", "a name").Name();
    }
    const auto found = frames.find(here);
    if (found == frames.end()) FailToFind(here, user);
    if (found->second.element.tag() == "link") return {this, here};
    if (found->second.element.tag() == "model") return models.at(here)->LinkOf("", user);
    here = found->second.attached_to;
  }
}

}  // namespace loopbench::harness
