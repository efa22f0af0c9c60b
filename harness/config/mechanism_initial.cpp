// "initial", "independent" and "observe" of a mechanism file.
#include <fmt/format.h>

#include <algorithm>
#include <iterator>

#include "harness/config/mechanism_sections.h"
#include "harness/config/spelling.h"

namespace loopbench::harness {
namespace {

/// One number for a joint with one coordinate, else as many as it has.
std::vector<double> ReadJointNumbers(const JsonNode& node, const JointDescription& joint,
                                     int count) {
  if (count == 1 && node.value().is_number()) return {node.Number()};
  const bool fits =
      node.value().is_array() && node.value().size() == static_cast<std::size_t>(count);
  if (fits && count > 0) return node.Numbers(static_cast<std::size_t>(count));
  const std::string_view type = ToString(joint.type);
  if (count == 0) {
    node.Fail(fmt::format("no value: \"{}\" is a {} and has none", joint.name, type));
  } else if (count == 1) {
    node.Fail(fmt::format("one number: \"{}\" is {}", joint.name, type));
  } else {
    node.Fail(fmt::format("{} numbers: \"{}\" is {}", count, joint.name, type));
  }
  return {};
}

/// Quaternions are normalised where they are used, so their length is free, but not zero.
void CheckQuaternion(const JsonNode& node, const std::vector<double>& values) {
  constexpr std::size_t kSpatialFree = 7;
  const bool zero = values.size() == kSpatialFree && values[0] == 0.0 && values[1] == 0.0 &&
                    values[2] == 0.0 && values[3] == 0.0;
  if (zero) node.Fail("a quaternion qw, qx, qy, qz that is not zero");
}

template <class Count>
std::vector<JointValues> ReadJointValues(const JsonNode& initial, const std::string& key,
                                         const MechanismDescription& description, Count count) {
  std::vector<JointValues> result;
  const auto section = initial.Optional(key);
  if (!section) return result;
  const std::vector<std::string> names = JointNames(description);
  section->ExpectObject(names);
  for (const auto& [name, node] : section->Members()) {
    const auto found = std::find(names.begin(), names.end(), name);
    if (found == names.end()) continue;
    const auto joint = std::distance(names.begin(), found);
    const JointDescription& described = description.joints[static_cast<std::size_t>(joint)];
    const int expected = count(described.type, description.space);
    result.push_back({static_cast<int>(joint), ReadJointNumbers(node, described, expected)});
    if (key == "coordinates") CheckQuaternion(node, result.back().values);
  }
  return result;
}

/// Owners of several speeds, named "<owner>.<component>": bodies in absolute coordinates, and free
/// joints.
std::vector<std::string> OwnersOfSpeeds(const MechanismDescription& description) {
  std::vector<std::string> owners = BodyNames(description);
  owners.erase(owners.begin() + kGround);
  for (const JointDescription& joint : description.joints) {
    if (SpeedCount(joint.type, description.space) > 1) owners.push_back(joint.name);
  }
  return owners;
}

void CheckIndependentName(const JsonNode& node, const std::string& name,
                          const MechanismDescription& description) {
  // Those of the plane and of space: a planar file may be run in either.
  static const std::vector<std::string> kComponents = {"angle", "x", "y", "z", "wx", "wy", "wz"};
  std::vector<std::string> joints;  // with one speed, which bears the joint's name
  for (const JointDescription& joint : description.joints) {
    if (SpeedCount(joint.type, description.space) == 1) joints.push_back(joint.name);
  }
  if (std::find(joints.begin(), joints.end(), name) != joints.end()) return;
  const std::size_t dot = name.rfind('.');
  if (dot == std::string::npos) {
    node.Fail("a joint with one speed or a body's speed such as \"bar1.angle\"",
              NearestSpelling(name, joints));
    return;
  }
  const std::string owner = name.substr(0, dot), component = name.substr(dot + 1);
  const std::vector<std::string> owners = OwnersOfSpeeds(description);
  if (std::find(owners.begin(), owners.end(), owner) == owners.end()) {
    const std::string nearest = NearestSpelling(owner, owners);
    node.Fail("a speed of a body or free joint", nearest.empty() ? "" : nearest + "." + component);
  } else if (std::find(kComponents.begin(), kComponents.end(), component) == kComponents.end()) {
    const std::string nearest = NearestSpelling(component, kComponents);
    node.Fail(fmt::format("one of the components {}", fmt::join(kComponents, ", ")),
              nearest.empty() ? "" : owner + "." + nearest);
  }
}

PendulumForm ReadPendulum(const JsonNode& node, const MechanismDescription& description) {
  PendulumForm form;
  if (!node.ExpectObject({"type", "body", "down_angle", "frequency_squared"})) return form;
  if (const auto type = node.Required("type", "\"pendulum\"")) {
    type->Choice({"pendulum"}, "a closed form");
  }
  if (const auto body = node.Required("body", "the name of a body")) {
    const auto index = ReadBodyName(*body, description);
    if (index) form.body = description.bodies[*index].name;
  }
  if (const auto angle = node.Required("down_angle", "a number [rad]")) {
    form.down_angle = angle->Number();
  }
  if (const auto frequency = node.Required("frequency_squared", "a number > 0 [1/s^2]")) {
    form.frequency_squared = frequency->Number(kPositive);
  }
  return form;
}

AngleCombination ReadCombination(const JsonNode& node, const MechanismDescription& description) {
  AngleCombination combination;
  if (!node.ExpectObject(BodyNames(description))) return combination;
  for (const auto& [body, coefficient] : node.Members()) {
    combination.emplace_back(body, coefficient.Number());
  }
  if (combination.empty()) node.Fail("at least one body with its coefficient");
  return combination;
}

}  // namespace

void ReadInitial(const JsonNode& root, MechanismDescription* description) {
  const auto node = root.Optional("initial");
  if (!node || !node->ExpectObject({"coordinates", "speeds", "held"})) return;
  InitialDescription& initial = description->initial;
  initial.coordinates = ReadJointValues(*node, "coordinates", *description, CoordinateCount);
  initial.speeds = ReadJointValues(*node, "speeds", *description, SpeedCount);
  const auto held = node->Optional("held");
  if (!held) return;
  for (const JsonNode& element : held->Elements("joint names")) {
    const auto joint = ReadJointName(element, *description);
    if (!joint) continue;
    const bool given =
        std::any_of(initial.coordinates.begin(), initial.coordinates.end(),
                    [&joint](const JointValues& values) { return values.joint == *joint; });
    if (!given) element.Fail("a joint with a value in /initial/coordinates");
    const bool again = std::count(initial.held.begin(), initial.held.end(), *joint) > 0;
    if (again) element.Fail("each joint once");
    initial.held.push_back(*joint);
  }
}

void ReadIndependent(const JsonNode& root, MechanismDescription* description) {
  const auto independent = root.Optional("independent");
  if (!independent) return;
  for (const JsonNode& element : independent->Elements("names")) {
    const std::string name = element.Text();
    if (name.empty()) continue;
    CheckIndependentName(element, name, *description);
    const auto& names = description->independent;
    const bool again = std::find(names.begin(), names.end(), name) != names.end();
    if (again) element.Fail("each name once");
    description->independent.push_back(name);
  }
}

SceneObservation ReadObservation(const JsonNode& root, const MechanismDescription& description) {
  SceneObservation observation;
  const auto node = root.Optional("observe");
  if (!node || !node->ExpectObject({"branch", "closed_form", "length"})) return observation;
  if (const auto branch = node->Optional("branch")) {
    for (const JsonNode& element : branch->Elements("combinations of body angles")) {
      observation.branch_invariants.push_back(ReadCombination(element, description));
    }
  }
  if (const auto form = node->Optional("closed_form")) {
    observation.closed_form = ReadPendulum(*form, description);
  }
  if (const auto length = node->Optional("length")) {
    observation.length = length->Number(kPositive);
  }
  return observation;
}

}  // namespace loopbench::harness
