// "forces" of a mechanism file.
#include <fmt/format.h>

#include "harness/config/mechanism_sections.h"

namespace loopbench::harness {
namespace {

/// The joint of a joint force; joints that carry no single coordinate have no room for one.
int ReadForceJoint(const JsonNode& force, const Draft& draft) {
  const auto node = force.Required("joint", "the name of a joint");
  if (!node) return 0;
  const auto joint = ReadJointName(*node, draft);
  if (!joint) return 0;
  const JointDescription& found = draft.joints[*joint];
  if (NumValues(found.type, draft.space, true) != 1) {
    node->FailAs(fmt::format("\"{}\" ({})", found.name, ToString(found.type)),
                 "a joint with one coordinate (revolute, prismatic or helical)");
  }
  return *joint;
}

/// "body" and "at" of an object; -1 stands for a body that is not known.
BodyPoint ReadBodyPoint(const JsonNode& node, const Draft& draft, bool may_be_ground) {
  BodyPoint point{-1};
  const std::string expected =
      may_be_ground ? "the name of a body or \"ground\"" : "the name of a body";
  if (const auto body = node.Required("body", expected)) {
    point.body = ReadBodyName(*body, draft).value_or(-1);
    if (point.body == kGround && !may_be_ground) body->Fail("a body that can move");
  }
  if (const auto at = node.Optional("at"); at && point.body >= 0) {
    point.at = ReadPoint(*at, draft.bodies[point.body], draft.space);
  }
  return point;
}

/// One end of a spring-damper.
BodyPoint ReadEnd(const JsonNode& force, const char* key, const Draft& draft) {
  const auto node = force.Required(key, "an object with keys \"body\", \"at\"");
  if (!node || !node->ExpectObject({"body", "at"})) return {-1};
  return ReadBodyPoint(*node, draft, true);
}

/// A force that lacks all of these does nothing.
void ExpectOneOf(const JsonNode& force, std::initializer_list<const char*> keys) {
  std::string list;
  for (const char* key : keys) {
    if (force.value().contains(key)) return;
    list += fmt::format("{}\"{}\"", list.empty() ? "" : ", ", key);
  }
  force.FailAs(fmt::format("none of {}", list), "at least one of them");
}

ForceDescription ReadJointTorque(const JsonNode& node, const Draft& draft) {
  JointTorque torque;
  if (!node.ExpectObject({"type", "joint", "value"})) return torque;
  torque.joint = ReadForceJoint(node, draft);
  if (const auto value = node.Required("value", "a number or a function of time")) {
    torque.value = ReadTimeFunction(*value);
  }
  return torque;
}

ForceDescription ReadJointSpring(const JsonNode& node, const Draft& draft) {
  if (!node.ExpectObject({"type", "joint", "stiffness", "rest", "preload"})) return JointSpring{};
  return JointSpring{.joint = ReadForceJoint(node, draft),
                     .stiffness = ReadRequiredNumber(node, "stiffness", kNotNegative),
                     .rest = ReadOptionalNumber(node, "rest"),
                     .preload = ReadOptionalNumber(node, "preload")};
}

ForceDescription ReadJointDamper(const JsonNode& node, const Draft& draft) {
  if (!node.ExpectObject({"type", "joint", "damping"})) return JointDamper{};
  return JointDamper{.joint = ReadForceJoint(node, draft),
                     .damping = ReadRequiredNumber(node, "damping", kNotNegative)};
}

ForceDescription ReadPointForce(const JsonNode& node, const Draft& draft) {
  PointForce force;
  if (!node.ExpectObject({"type", "body", "at", "force", "axes"})) return force;
  const BodyPoint point = ReadBodyPoint(node, draft, false);
  force.body = point.body;
  force.at = point.at;
  if (const auto vector = node.Required("force", "an array of 2 or 3 numbers [N]")) {
    force.force = ReadVector(*vector, draft.space);
  }
  if (const auto axes = node.Optional("axes")) {
    force.in_body_axes = axes->Choice({"ground", "body"}, "the axes of the force") == 1;
  }
  return force;
}

ForceDescription ReadSpringDamper(const JsonNode& node, const Draft& draft) {
  SpringDamper spring;
  if (!node.ExpectObject({"type", "from", "to", "stiffness", "damping", "length", "preload"})) {
    return spring;
  }
  spring.from = ReadEnd(node, "from", draft);
  spring.to = ReadEnd(node, "to", draft);
  if (spring.from.body >= 0 && spring.from.body == spring.to.body) {
    node.FailAs(
        fmt::format("a spring-damper of \"{}\" with itself", draft.bodies[spring.from.body].name),
        "two different bodies");
  }
  ExpectOneOf(node, {"stiffness", "damping", "preload"});
  spring.stiffness = ReadOptionalNumber(node, "stiffness", kNotNegative);
  spring.damping = ReadOptionalNumber(node, "damping", kNotNegative);
  spring.length = ReadOptionalNumber(node, "length", kNotNegative);
  spring.preload = ReadOptionalNumber(node, "preload");
  return spring;
}

ForceDescription ReadDrag(const JsonNode& node, const Draft& draft) {
  Drag drag;
  if (!node.ExpectObject({"type", "body", "at", "linear", "quadratic"})) return drag;
  drag.point = ReadBodyPoint(node, draft, false);
  ExpectOneOf(node, {"linear", "quadratic"});
  drag.linear = ReadOptionalNumber(node, "linear", kNotNegative);
  drag.quadratic = ReadOptionalNumber(node, "quadratic", kNotNegative);
  return drag;
}

ForceDescription ReadForce(const JsonNode& node, const Draft& draft) {
  using Reader = ForceDescription (*)(const JsonNode&, const Draft&);
  static const NameList kTypes = {"joint_torque", "joint_spring",  "joint_damper",
                                  "point_force",  "spring_damper", "drag"};
  static constexpr Reader kReaders[] = {ReadJointTorque, ReadJointSpring,  ReadJointDamper,
                                        ReadPointForce,  ReadSpringDamper, ReadDrag};
  std::optional<int> type;
  if (!node.value().is_object()) {
    node.Fail("an object that describes a force");
  } else if (const auto name = node.Required("type", "a force type")) {
    type = name->Choice(kTypes, "a force type");
  }
  return type ? kReaders[*type](node, draft) : JointTorque{};
}

}  // namespace

void ReadForces(const JsonNode& root, Draft* draft) {
  const auto forces = root.Optional("forces");
  if (!forces) return;
  for (const JsonNode& element : forces->Elements("forces")) {
    draft->forces.push_back(ReadForce(element, *draft));
  }
}

}  // namespace loopbench::harness
