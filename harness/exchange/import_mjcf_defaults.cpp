// Classes of defaults, and orientations.
#include <fmt/format.h>

#include "harness/exchange/import_mjcf.h"

namespace loopbench::harness {

namespace {

constexpr const char* kMain = "main";     // the class of elements without one
constexpr std::size_t kMostLayers = 100;  // each of many elements looks at all of its defaults

/// What an element of a class describes: its tag, or "actuator".
std::string DescribedBy(const std::string& tag) {
  static const std::set<std::string> kActuators = {"general",     "motor",  "position", "velocity",
                                                   "intvelocity", "damper", "cylinder", "muscle",
                                                   "adhesion",    "plugin"};
  return kActuators.contains(tag) ? "actuator" : tag;
}

}  // namespace

std::optional<XmlValue> MjcfElement::Attribute(const std::string& name) const {
  std::optional<XmlValue> found = own_.Attribute(name);
  for (const XmlElement& layer : classes_) {
    auto value = layer.Attribute(name);
    if (!found) found = std::move(value);
  }
  return found;
}

double MjcfElement::Number(const std::string& name, double otherwise, const Range& range) const {
  const auto value = Attribute(name);
  return value ? value->Number(range) : otherwise;
}

std::vector<XmlElement> MjcfElement::Layers() const {
  std::vector<XmlElement> layers = {own_};
  layers.insert(layers.end(), classes_.begin(), classes_.end());
  return layers;
}

void MjcfDefaults::Read(const XmlElement& element, const std::string& parent) {
  const auto given = element.Attribute("class");
  if (!given && !parent.empty()) element.Fail("no \"class\"", "a name: it is a nested class");
  const std::string name = parent.empty() ? kMain : given->Name();
  if (parent.empty()) {
    // a second <default> at the top adds to the first
    const std::string also = given ? given->Name() : kMain;
    if (also != kMain && classes_.contains(also)) given->Fail("a class that is not described yet");
    names_of_main_.insert(also);
  } else if (classes_.contains(Known(name))) {
    given->Fail("a class that is not described yet");
  }
  classes_[name].parent = parent;
  for (const XmlElement& child : element.Children()) {
    if (child.tag() == "default") {
      Read(child, name);
    } else {
      classes_[name].elements[DescribedBy(child.tag())].push_back(child);
    }
  }
}

std::string MjcfDefaults::Known(const std::string& name) const {
  return names_of_main_.contains(name) ? kMain : name;
}

void MjcfDefaults::CheckClass(const XmlValue& value) const {
  const std::string name = Known(value.text());
  if (!classes_.contains(name) && name != kMain) value.Fail("a class described in <default>");
}

std::vector<XmlElement> MjcfDefaults::Layers(const XmlElement& element,
                                             const std::string& childclass, const std::string& tag,
                                             std::set<Use>* used) const {
  const std::string wanted = DescribedBy(tag.empty() ? element.tag() : tag);
  std::string name = childclass.empty() ? kMain : childclass;
  if (const auto given = element.Attribute("class")) {
    CheckClass(*given);
    name = given->text();
  }
  std::vector<XmlElement> layers;
  for (auto found = classes_.find(Known(name)); found != classes_.end();
       found = classes_.find(found->second.parent)) {
    const auto defaults = found->second.elements.find(wanted);
    if (defaults == found->second.elements.end()) continue;
    // of several in one class the last one has the last word
    layers.insert(layers.end(), defaults->second.rbegin(), defaults->second.rend());
    if (used != nullptr) used->emplace(found->first, wanted);
    if (layers.size() > kMostLayers) {
      element.Fail(fmt::format("more than {} defaults of its kind", kMostLayers), "fewer");
    }
  }
  return layers;
}

MjcfElement MjcfDefaults::Of(const XmlElement& element, const std::string& childclass,
                             const std::string& tag) const {
  return {element, Layers(element, childclass, tag, &used_)};
}

MjcfElement MjcfDefaults::Peek(const XmlElement& element, const std::string& childclass,
                               const std::string& tag) const {
  return {element, Layers(element, childclass, tag, nullptr)};
}

void MjcfDefaults::IgnoreUnused() const {
  for (const auto& [name, one] : classes_) {
    for (const auto& [what, elements] : one.elements) {
      if (used_.contains({name, what})) continue;
      for (const XmlElement& element : elements) element.Ignore();
    }
  }
}

Eigen::Quaterniond MjcfModel::OrientationOf(const MjcfElement& element) const {
  constexpr const char* kWays[] = {"quat", "axisangle", "euler", "xyaxes", "zaxis"};
  std::optional<XmlValue> found;
  std::string way;
  for (const XmlElement& layer : element.Layers()) {
    std::string here;
    for (const char* one : kWays) {
      auto value = layer.Attribute(one);
      if (!value) continue;
      if (!here.empty()) value->Fail(fmt::format("one orientation: there is \"{}\" too", here));
      here = one;
      if (way.empty()) found = std::move(value);
    }
    if (way.empty()) way = here;
  }
  if (!found) return Eigen::Quaterniond::Identity();
  const auto unit = [&](const Eigen::Vector3d& v) -> Eigen::Vector3d {
    if (!(v.norm() > 0.0)) found->Fail("axes that are not zero");
    return v.normalized();
  };
  if (way == "quat") {
    const std::vector<double> q = draft->Numbers(*found, "q");
    return UnitQuaternion(*found, {q[0], q[1], q[2], q[3]});
  }
  if (way == "euler") {
    const Eigen::Vector3d angles = draft->Vector(*found, settings.degrees ? "nnn" : "aaa");
    return FromEuler(settings.euler,
                     angles.unaryExpr([&](double angle) { return settings.Angle(angle); }));
  }
  if (way == "axisangle") {
    const std::vector<double> a = draft->Numbers(*found, settings.degrees ? "dn" : "da");
    return Eigen::Quaterniond(Eigen::AngleAxisd(settings.Angle(a[3]), unit({a[0], a[1], a[2]})));
  }
  if (way == "zaxis") {
    return TurnOfZ(unit(draft->Vector(*found, "d")));
  }
  const std::vector<double> a = draft->Numbers(*found, "dd");
  const Eigen::Vector3d x = unit({a[0], a[1], a[2]}), y_given(a[3], a[4], a[5]);
  const Eigen::Vector3d y = unit(y_given - x.dot(y_given) * x);
  Eigen::Matrix3d R;
  R << x, y, x.cross(y);
  return Eigen::Quaterniond(R);
}

Placement MjcfModel::PlacementOf(const MjcfElement& element) const {
  Placement X;
  if (const auto position = element.Attribute("pos")) X.p = position->Vector();
  X.q = OrientationOf(element);
  return X;
}

std::optional<MjcfLimits> MjcfModel::LimitsOf(const MjcfElement& element, const std::string& flag,
                                              const std::string& range) const {
  const auto limited = element.Attribute(flag);
  const auto given = element.Attribute(range);
  const std::size_t choice = limited ? limited->Choice({"false", "true", "auto"}) : 2;
  if (choice == 0 || (choice == 2 && !(given && settings.limits_by_range))) return std::nullopt;
  if (!given) element.own().Fail(fmt::format("\"{}\" without \"{}\"", flag, range), "both");
  const std::vector<double> ends = given->Numbers(2, 2);
  if (ends[0] < ends[1]) return MjcfLimits{ends[0], ends[1]};
  if (choice == 1) given->Fail("two numbers, the first below the second");
  return std::nullopt;  // as MuJoCo has it, and its default: 0 0
}

void MjcfModel::NoteLimits(const MjcfElement& element, const char* reason) const {
  const auto flag = element.Attribute("limited"), range = element.Attribute("range");
  if ((flag && flag->text() == "true") || LimitsOf(element, "limited", "range")) {
    draft->Note(element.own(), range ? "range" : "limited", reason, true);
  }
}

const BodyPoint& MjcfModel::SiteNamed(const XmlValue& value) const {
  const auto found = sites.find(value.Name());
  if (found == sites.end()) value.Fail("the name of a site");
  return found->second;
}

MjcfJoint& MjcfModel::JointNamed(const XmlValue& value) {
  const auto found = joint_names.find(value.Name());
  if (found == joint_names.end()) value.Fail("the name of a joint");
  return joints[found->second];
}

}  // namespace loopbench::harness
