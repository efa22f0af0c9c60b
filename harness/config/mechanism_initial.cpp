// "initial", "independent" and "observe" of a mechanism file.
#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "harness/config/mechanism_sections.h"
#include "harness/json/spelling.h"

namespace loopbench::harness {
namespace {

/// One number for a joint with one coordinate, else as many as it has.
std::vector<double> ReadJointNumbers(const JsonNode& node, const JointDescription& joint,
                                     SpaceKind space, bool speeds) {
  const int count = NumValues(joint.type, space, speeds);
  if (count == 1 && node.value().is_number()) return {node.Number()};
  const auto fits = [&node](int numbers) {
    return node.value().is_array() && node.value().size() == static_cast<std::size_t>(numbers);
  };
  if (fits(count) && count > 0) return node.Numbers(static_cast<std::size_t>(count));
  const std::string_view type = ToString(joint.type);
  if (fits(NumValues(joint.type, SpaceKind::kSpatial, speeds)) && count > 0) {
    node.FailWithCure(kSpatialCure, fmt::format("{} numbers in the plane: \"{}\" is {}", count,
                                                joint.name, type));
  } else if (count == 0) {
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
  const auto zeros = std::count(values.begin(), std::min(values.begin() + 4, values.end()), 0.0);
  if (zeros == 4) node.Fail("a quaternion qw, qx, qy, qz that is not zero");
}

std::vector<JointValues> ReadJointValues(const JsonNode& initial, const std::string& key,
                                         const Draft& draft, bool speeds) {
  std::vector<JointValues> result;
  const auto section = initial.Optional(key);
  if (!section) return result;
  if (!section->ExpectObject(draft.joint_names)) return result;
  for (const auto& [name, node] : section->Members()) {
    const auto joint = draft.joint_names.Find(name);
    if (!joint) continue;
    const JointDescription& described = draft.joints[static_cast<std::size_t>(*joint)];
    const int expected = NumValues(described.type, draft.space, speeds);
    if (expected == 1 && !described.motions.empty()) {
      node.FailAs(fmt::format("a value of \"{}\", whose motion is prescribed", described.name),
                  "none");
      continue;
    }
    result.push_back({*joint, ReadJointNumbers(node, described, draft.space, speeds)});
    const bool quaternion = expected > NumValues(described.type, draft.space, true);
    if (quaternion) CheckQuaternion(node, result.back().values);
  }
  return result;
}

/// What bears speeds: joints with one, which has the joint's name, and owners of several, named
/// "<owner>.<component>": bodies in absolute coordinates, and free joints.
struct SpeedNames {
  NameList joints, owners;
};

SpeedNames NamesOfSpeeds(const Draft& draft) {
  SpeedNames names;
  for (std::size_t i = kGround + 1; i < draft.bodies.size(); ++i) {
    names.owners.Add(draft.bodies[i].name);
  }
  for (const JointDescription& joint : draft.joints) {
    const int count = NumValues(joint.type, draft.space, true);
    if (count == 1) names.joints.Add(joint.name);
    if (count > 1) names.owners.Add(joint.name);
  }
  return names;
}

void CheckIndependentName(const JsonNode& node, const std::string& name, const SpeedNames& names) {
  // Those of the plane and of space: a planar file may be run in either.
  static const NameList kComponents = {"angle", "x", "y", "z", "wx", "wy", "wz"};
  if (names.joints.Find(name)) return;
  const std::size_t dot = name.rfind('.');
  const std::string owner = name.substr(0, dot);
  const std::string component = dot == std::string::npos ? "" : name.substr(dot + 1);
  if (names.owners.Find(owner) && kComponents.Find(component)) return;
  if (node.errors().full()) {
    node.FailAs("", "");
  } else if (dot == std::string::npos) {
    node.Fail("a joint with one speed or a body's speed such as \"bar1.angle\"",
              NearestSpelling(name, names.joints.all()));
  } else if (!names.owners.Find(owner)) {
    const std::string nearest = NearestSpelling(owner, names.owners.all());
    node.Fail("a speed of a body or of a joint with several",
              nearest.empty() ? "" : nearest + "." + component);
  } else {
    const std::string nearest = NearestSpelling(component, kComponents.all());
    node.Fail(fmt::format("one of the components {}", fmt::join(kComponents.all(), ", ")),
              nearest.empty() ? "" : owner + "." + nearest);
  }
}

PendulumForm ReadPendulum(const JsonNode& node, const Draft& draft) {
  PendulumForm form;
  if (!node.ExpectObject({"type", "body", "down_angle", "frequency_squared"})) return form;
  if (const auto type = node.Required("type", "\"pendulum\"")) {
    type->Choice({"pendulum"}, "a closed form");
  }
  if (const auto body = node.Required("body", "the name of a body")) {
    const auto index = ReadBodyName(*body, draft);
    if (index) form.body = draft.bodies[*index].name;
  }
  if (const auto angle = node.Required("down_angle", "a number [rad]")) {
    form.down_angle = angle->Number();
  }
  if (const auto frequency = node.Required("frequency_squared", "a number > 0 [1/s^2]")) {
    form.frequency_squared = frequency->Number(kPositive);
  }
  return form;
}

AngleCombination ReadCombination(const JsonNode& node, const Draft& draft) {
  AngleCombination combination;
  if (!node.ExpectObject(draft.body_names)) return combination;
  for (const auto& [body, coefficient] : node.Members()) {
    combination.emplace_back(body, coefficient.Number());
  }
  if (combination.empty()) node.Fail("at least one body with its coefficient");
  return combination;
}

}  // namespace

void ReadInitial(const JsonNode& root, Draft* draft) {
  const auto node = root.Optional("initial");
  if (!node || !node->ExpectObject({"coordinates", "speeds", "held"})) return;
  InitialDescription& initial = draft->initial;
  initial.coordinates = ReadJointValues(*node, "coordinates", *draft, false);
  initial.speeds = ReadJointValues(*node, "speeds", *draft, true);
  const auto held = node->Optional("held");
  if (!held) return;
  std::set<int> given, known;
  for (const JointValues& values : initial.coordinates) given.insert(values.joint);
  for (const JsonNode& element : held->Elements("joint names")) {
    const auto joint = ReadJointName(element, *draft);
    if (!joint) continue;
    if (!given.contains(*joint)) element.Fail("a joint with a value in /initial/coordinates");
    if (!known.insert(*joint).second) element.Fail("each joint once");
    initial.held.push_back(*joint);
  }
}

void ReadIndependent(const JsonNode& root, Draft* draft) {
  const auto independent = root.Optional("independent");
  if (!independent) return;
  const SpeedNames names = NamesOfSpeeds(*draft);
  std::set<std::string> known;
  for (const JsonNode& element : independent->Elements("names")) {
    const std::string name = element.Text();
    if (name.empty()) continue;
    CheckIndependentName(element, name, names);
    if (!known.insert(name).second) element.Fail("each name once");
    draft->independent.push_back(name);
  }
}

SceneObservation ReadObservation(const JsonNode& root, const Draft& draft) {
  SceneObservation observation;
  const auto node = root.Optional("observe");
  if (!node || !node->ExpectObject({"branch", "closed_form", "length"})) return observation;
  if (const auto branch = node->Optional("branch")) {
    for (const JsonNode& element : branch->Elements("combinations of body angles")) {
      observation.branch_invariants.push_back(ReadCombination(element, draft));
    }
  }
  if (const auto form = node->Optional("closed_form")) {
    observation.closed_form = ReadPendulum(*form, draft);
  }
  if (const auto length = node->Optional("length")) {
    observation.length = length->Number(kPositive);
  }
  return observation;
}

}  // namespace loopbench::harness
