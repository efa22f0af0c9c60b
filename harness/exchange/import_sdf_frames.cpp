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

SdfFrame ReadSdfPose(const XmlElement& element, SdfVersion version, ImportDraft* draft) {
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
  const bool in_degrees = degrees && degrees->Bool();
  const auto format = pose->Attribute("rotation_format");
  const bool quaternion = format && format->Choice({"euler_rpy", "quat_xyzw"}) == 1;
  const XmlValue content = pose->Content();
  if (content.text().empty()) return frame;
  const std::vector<double> p = draft->Numbers(content, quaternion   ? "nnnr"
                                                        : in_degrees ? "nnnnnn"
                                                                     : "nnnaaa");
  frame.raw.p = {p[0], p[1], p[2]};
  if (quaternion) {
    frame.raw.q = UnitQuaternion(content, {p[6], p[3], p[4], p[5]});
  } else {
    frame.raw.q =
        FromRollPitchYaw((in_degrees ? kDegree : 1.0) * Eigen::Vector3d(p[3], p[4], p[5]));
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
  // frames that stand in each other, up to one that is known
  std::vector<std::pair<std::string, Placement>> chain;
  Placement X;
  std::string here = name;
  while (!IsOwn(here, *this)) {
    if (const auto known = resolved_.find(here); known != resolved_.end()) {
      X = known->second;
      break;
    }
    // no chain without a cycle has more than each frame and a name within each model
    if (chain.size() > 2 * frames.size()) {
      user.Fail("frames that are relative to each other", "no cycle");
    }
    std::string rest, next = here.substr(0, here.find(kWithin));
    if (const SdfScope* nested = NestedScope(*this, here, &rest)) {
      chain.emplace_back(here, nested->Resolve(rest, user));
    } else {
      const auto found = frames.find(here);
      if (found == frames.end()) FailToFind(here, user);
      chain.emplace_back(here, found->second.raw);
      next = found->second.relative_to;
    }
    here = next;
  }
  for (auto link = chain.rbegin(); link != chain.rend(); ++link) {
    X = X * link->second;
    resolved_.emplace(link->first, X);
  }
  return X;
}

SdfScope::Link SdfScope::LinkOf(const std::string& name, const XmlElement& user) const {
  std::vector<std::string> chain;  // each attached to the next
  std::string here = name;
  std::optional<Link> link;
  while (!link) {
    if (const auto known = links_.find(here); known != links_.end()) {
      link = known->second;
      break;
    }
    if (chain.size() > frames.size() + 1) {
      user.Fail("frames that are attached to each other", "no cycle");
    }
    chain.push_back(here);
    std::string rest;
    if (const SdfScope* nested = NestedScope(*this, here, &rest)) {
      link = nested->LinkOf(rest, user);
    } else if (IsOwn(here, *this) && is_world()) {
      link = Link{nullptr, ""};
    } else if (IsOwn(here, *this)) {
      // a model moves with its canonical link, the first one unless it names another
      const auto canonical = element.Attribute("canonical_link");
      const std::vector<XmlElement> links = element.Children("link");
      if (canonical && !canonical->text().empty()) {
        here = canonical->text();
      } else if (links.empty()) {
        user.Fail(fmt::format("the model of \"{}\" without a link", name), "one");
      } else {
        here = links[0].Required("name", "a name").Name();
      }
    } else {
      const auto found = frames.find(here);
      if (found == frames.end()) FailToFind(here, user);
      const std::string tag = found->second.element.tag();
      if (tag == "link") link = Link{this, here};
      if (tag == "model") link = models.at(here)->LinkOf("", user);
      here = found->second.attached_to;
    }
  }
  for (const std::string& attached : chain) links_.emplace(attached, *link);
  return *link;
}

}  // namespace loopbench::harness
