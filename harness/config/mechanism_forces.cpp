// "forces" of a mechanism file.
#include <fmt/format.h>

#include "harness/config/mechanism_sections.h"

namespace loopbench::harness {
namespace {

/// Joints that carry no single coordinate have no room for a force.
template <class Force>
FieldValue<PartOf<Force>> JointOf(int Force::*joint) {
  return {TextSchema(), [=](const JsonNode& node, PartOf<Force>& force) {
            const auto index = ReadJointName(node, *force.draft);
            if (!index) return;
            force.*joint = *index;
            const JointDescription& found = force.draft->joints[force.*joint];
            if (NumValues(found.type, force.draft->space, true) == 1) return;
            node.FailAs(fmt::format("\"{}\" ({})", found.name, ToString(found.type)),
                        "a joint with one coordinate (revolute, prismatic or helical)");
          }};
}

/// A force that lacks all of these does nothing.
template <class Force>
FieldValue<PartOf<Force>> OneOf(std::vector<std::string> keys) {
  std::vector<Json> required;
  for (const std::string& key : keys) required.push_back(Requires({key}));
  return {EitherSchema(required), [=](const JsonNode& node, PartOf<Force>&) {
            const auto has = [&](const std::string& key) { return node.value().contains(key); };
            if (std::ranges::any_of(keys, has)) return;
            node.FailAs(fmt::format("none of \"{}\"", fmt::join(keys, "\", \"")),
                        "at least one of them");
          }};
}

constexpr const char* kJoint = "the name of a joint";
constexpr const char* kJointOf = "With one coordinate: revolute, prismatic or helical.";
constexpr const char* kPlaceOnBody =
    "The name of one of the body's points, or coordinates in body axes [m]; default its origin.";

const Fields<PartOf<JointTorque>>& TorqueFields() {
  static const Fields<PartOf<JointTorque>> fields(
      "joint_torque",
      "A given moment or force on a joint's second body, its opposite on the first.",
      {{"type", ChoiceSchema({"joint_torque"}), "What it is.", "a force type"},
       {"joint", JointOf(&JointTorque::joint), kJointOf, kJoint},
       {"value", TimeFunctionOf(&JointTorque::value), "[N m] or [N] on the joint's second body.",
        "a number or a function of time"}});
  return fields;
}

const Fields<PartOf<JointSpring>>& JointSpringFields() {
  static const Fields<PartOf<JointSpring>> fields(
      "joint_spring", "preload - stiffness (q - rest) on the joint's coordinate q.",
      {{"type", ChoiceSchema({"joint_spring"}), "What it is.", "a force type"},
       {"joint", JointOf(&JointSpring::joint), kJointOf, kJoint},
       {"stiffness", Number(&JointSpring::stiffness, kNotNegative), "[N m/rad] or [N/m]",
        "a number >= 0"},
       {"rest", Number(&JointSpring::rest),
        "Coordinate at which only the preload is left [rad] or [m]."},
       {"preload", Number(&JointSpring::preload), "[N m] or [N]"}});
  return fields;
}

const Fields<PartOf<JointDamper>>& JointDamperFields() {
  static const Fields<PartOf<JointDamper>> fields(
      "joint_damper", "-damping u on the joint's speed u.",
      {{"type", ChoiceSchema({"joint_damper"}), "What it is.", "a force type"},
       {"joint", JointOf(&JointDamper::joint), kJointOf, kJoint},
       {"damping", Number(&JointDamper::damping, kNotNegative), "[N m s/rad] or [N s/m]",
        "a number >= 0"}});
  return fields;
}

const Fields<PartOf<PointForce>>& PointForceFields() {
  static const Fields<PartOf<PointForce>> fields(
      "point_force", "A constant force at a point of a body.",
      {{"type", ChoiceSchema({"point_force"}), "What it is.", "a force type"},
       {"body", BodyOf<PointForce>(&PointForce::body, false), "A body that can move.",
        "the name of a body"},
       {"at", PlaceOf<PointForce>(&PointForce::body, &PointForce::at), kPlaceOnBody},
       {"force", VectorOf(&PointForce::force), "[N]", "an array of 2 or 3 numbers [N]"},
       {"axes", Choice(&PointForce::in_body_axes, {"ground", "body"}, "the axes of the force"),
        "Body: the force turns with the body."}});
  return fields;
}

const Fields<PartOf<BodyPoint>>& EndFields() {
  static const Fields<PartOf<BodyPoint>> fields(
      "end", "A point of a body.",
      {{"body", BodyOf<BodyPoint>(&BodyPoint::body, true), "A body's name or \"ground\".",
        "the name of a body or \"ground\""},
       {"at", PlaceOf<BodyPoint>(&BodyPoint::body, &BodyPoint::at), kPlaceOnBody}});
  return fields;
}

void CheckEnds(const JsonNode& node, PartOf<SpringDamper>& spring) {
  if (spring.from.body < 0 || spring.from.body != spring.to.body) return;
  node.FailAs(fmt::format("a spring-damper of \"{}\" with itself",
                          spring.draft->bodies[spring.from.body].name),
              "two different bodies");
}

const Fields<PartOf<SpringDamper>>& SpringDamperFields() {
  constexpr const char* kEnd = "an object with keys \"body\", \"at\"";
  static const Fields<PartOf<SpringDamper>> fields(
      "spring_damper",
      "The tension preload + stiffness (d - length) + damping d' between points at distance d.",
      {{"type", ChoiceSchema({"spring_damper"}), "What it is.", "a force type"},
       {"from", Part(&SpringDamper::from, EndFields()), "One end.", kEnd},
       {"to", Part(&SpringDamper::to, EndFields()), "The other, on another body.", kEnd},
       {"", By(Json::object(), CheckEnds)},
       {"", OneOf<SpringDamper>({"stiffness", "damping", "preload"})},
       {"stiffness", Number(&SpringDamper::stiffness, kNotNegative), "[N/m]"},
       {"damping", Number(&SpringDamper::damping, kNotNegative), "[N s/m]"},
       {"length", Number(&SpringDamper::length, kNotNegative),
        "Distance of the points at which only the preload is left [m]."},
       {"preload", Number(&SpringDamper::preload), "Tension at that distance [N]."}});
  return fields;
}

const Fields<PartOf<Drag>>& DragFields() {
  static const auto body = [](Drag& drag) -> int& { return drag.point.body; };
  static const auto at = [](Drag& drag) -> Eigen::Vector3d& { return drag.point.at; };
  static const Fields<PartOf<Drag>> fields(
      "drag", "-(linear + quadratic |v|) v at a point of velocity v.",
      {{"type", ChoiceSchema({"drag"}), "What it is.", "a force type"},
       {"body", BodyOf<Drag>(body, false), "A body that can move.", "the name of a body"},
       {"at", PlaceOf<Drag>(body, at), kPlaceOnBody},
       {"", OneOf<Drag>({"linear", "quadratic"})},
       {"linear", Number(&Drag::linear, kNotNegative), "[N s/m]"},
       {"quadratic", Number(&Drag::quadratic, kNotNegative), "[N s^2/m^2]"}});
  return fields;
}

/// Reads one of several kinds of force.
template <class Force>
ForceDescription ReadAs(const Fields<PartOf<Force>>& fields, const JsonNode& node,
                        const Draft& draft, Force unread = {}) {
  return ReadPart(fields, node, draft, unread);
}

ForceDescription ReadForce(const JsonNode& node, const Draft& draft) {
  static const NameList kTypes = {"joint_torque", "joint_spring",  "joint_damper",
                                  "point_force",  "spring_damper", "drag"};
  std::optional<int> type;
  if (!node.value().is_object()) {
    node.Fail("an object that describes a force");
  } else if (const auto name = node.Required("type", "a force type")) {
    type = name->Choice(kTypes, "a force type");
  }
  if (type == 1) return ReadAs(JointSpringFields(), node, draft);
  if (type == 2) return ReadAs(JointDamperFields(), node, draft);
  if (type == 3) return ReadAs(PointForceFields(), node, draft);
  // ends are not known yet: -1 matches no other
  if (type == 4) return ReadAs(SpringDamperFields(), node, draft, {.from = {-1}, .to = {-1}});
  if (type == 5) return ReadAs(DragFields(), node, draft);
  return type ? ReadAs(TorqueFields(), node, draft) : JointTorque{};
}

void ReadForces(const JsonNode& node, Draft& draft) {
  for (const JsonNode& element : node.Elements("forces")) {
    draft.forces.push_back(ReadForce(element, draft));
  }
}

}  // namespace

FieldValue<Draft> ForcesValue() {
  const Json kinds = EitherSchema({TorqueFields().Schema(), JointSpringFields().Schema(),
                                   JointDamperFields().Schema(), PointForceFields().Schema(),
                                   SpringDamperFields().Schema(), DragFields().Schema()});
  return By(ArraySchema(Named("force", kinds)), ReadForces);
}

}  // namespace loopbench::harness
