// "joints" of a mechanism file.
#include <fmt/format.h>

#include "harness/config/mechanism_sections.h"

namespace loopbench::harness {
namespace {

/// A number (about z) or a rotation vector of three numbers.
Eigen::Vector3d ReadRotation(const JsonNode& node, SpaceKind space) {
  if (node.value().is_number()) return {0.0, 0.0, node.Number()};
  if (!node.value().is_array() || node.value().size() != 3) {
    node.Fail("a number (rotation about z) or an array of 3 numbers [rad]");
    return Eigen::Vector3d::Zero();
  }
  const Eigen::Vector3d rotation = node.Vector();
  const bool about_z = rotation.x() == 0.0 && rotation.y() == 0.0;
  if (space == SpaceKind::kPlanar && !about_z) {
    node.FailWithCure(kSpatialCure, "a rotation about z in a planar mechanism");
  }
  return rotation;
}

JointSide ReadSide(const JsonNode& joint, const char* key, const Draft& draft) {
  JointSide side;
  side.body = -1;  // not known: matches no other side
  const auto node = joint.Required(key, "an object with keys \"body\", \"at\", \"rotation\"");
  if (!node || !node->ExpectObject({"body", "at", "rotation"})) return side;
  if (const auto body = node->Required("body", "the name of a body or \"ground\"")) {
    side.body = ReadBodyName(*body, draft).value_or(-1);
  }
  if (const auto at = node->Optional("at"); at && side.body >= 0) {
    side.position = ReadPoint(*at, draft.bodies[side.body], draft.space);
  }
  if (const auto rotation = node->Optional("rotation")) {
    side.rotation = ReadRotation(*rotation, draft.space);
  }
  return side;
}

Eigen::Vector3d ReadAxis(const JsonNode& node, JointType type, SpaceKind space) {
  const Eigen::Vector3d axis = node.Vector();
  if (OwnAxis(type) == '-') {
    node.Fail(fmt::format("no axis on a {} joint", ToString(type)));
  } else if (axis.isZero()) {
    if (node.value().is_array()) node.Fail("an axis that is not zero");
  } else if (space == SpaceKind::kPlanar) {
    const bool along_z = axis.x() == 0.0 && axis.y() == 0.0 && axis.z() > 0.0;
    if (OwnAxis(type) == 'z' && !along_z) {
      node.FailWithCure(kSpatialCure, "an axis along +z in a planar mechanism");
    }
    if (OwnAxis(type) == 'x' && axis.z() != 0.0) {
      node.FailWithCure(kSpatialCure, "an axis with z = 0 in a planar mechanism");
    }
  }
  return axis;
}

/// A number that one type of joint must have and no other may.
double ReadParameter(const JsonNode& node, const std::string& key, const JointDescription& joint,
                     JointType owner, const Range& range, std::string_view what) {
  if (joint.type == owner) {
    const auto found = node.Required(key, what);
    return found ? found->Number(range) : 1.0;
  }
  if (const auto found = node.Optional(key)) {
    found->Fail(fmt::format("no {} on a {} joint", key, ToString(joint.type)));
  }
  return 0.0;
}

/// `speeds`: coordinates that may be prescribed.
PrescribedMotion ReadOneMotion(const JsonNode& node, int speeds,
                               const std::vector<PrescribedMotion>& taken) {
  PrescribedMotion motion{0, Polynomial{{0.0}}};
  if (!node.ExpectObject({"coordinate", "value"})) return motion;
  if (const auto coordinate = node.Required("coordinate", "the number of a coordinate")) {
    motion.coordinate = static_cast<int>(coordinate->Integer(0, speeds - 1));
    for (const PrescribedMotion& other : taken) {
      if (other.coordinate == motion.coordinate)
        coordinate->Fail("a coordinate not yet prescribed");
    }
  }
  if (const auto value = node.Required("value", "a number or a function of time")) {
    motion.value = ReadTimeFunction(*value);
  }
  return motion;
}

/// One function for a joint with one coordinate, else a list that names coordinates.
void ReadMotions(const JsonNode& node, SpaceKind space, JointDescription* joint) {
  const int speeds = NumValues(joint->type, space, true);
  if (speeds == 0 || NumValues(joint->type, space, false) != speeds) {
    node.FailAs(fmt::format("a motion of a {} joint", ToString(joint->type)),
                "a joint whose coordinates are angles and shifts");
    return;
  }
  if (!node.value().is_array()) {
    if (speeds > 1) {
      node.Fail(
          fmt::format("an array of {{\"coordinate\", \"value\"}}: a {} joint has {} coordinates",
                      ToString(joint->type), speeds));
      return;
    }
    joint->motions = {{0, ReadTimeFunction(node)}};
    return;
  }
  for (const JsonNode& element : node.Elements("motions")) {
    joint->motions.push_back(ReadOneMotion(element, speeds, joint->motions));
  }
}

JointDescription ReadJoint(const JsonNode& node, const Draft& draft) {
  JointDescription joint;
  if (!node.ExpectObject(
          {"name", "type", "from", "to", "axis", "pitch", "length", "motion", "cut"})) {
    return joint;
  }
  joint.name = ReadNewName(node, draft.joint_names);
  if (const auto type = node.Required("type", "a joint type")) {
    joint.type = static_cast<JointType>(type->Choice(JointTypeNames(), "a joint type").value_or(0));
    if (draft.space == SpaceKind::kPlanar && !ExistsInPlane(joint.type)) {
      type->FailWithCure(kSpatialCure, "a joint of the plane");
      return joint;  // what else it has cannot be judged
    }
  }
  joint.from = ReadSide(node, "from", draft);
  joint.to = ReadSide(node, "to", draft);
  if (joint.from.body >= 0 && joint.from.body == joint.to.body) {
    node.FailAs(fmt::format("a joint of \"{}\" with itself", draft.bodies[joint.from.body].name),
                "two different bodies");
  }
  if (const auto axis = node.Optional("axis")) {
    joint.axis = ReadAxis(*axis, joint.type, draft.space);
  }
  joint.pitch = ReadParameter(node, "pitch", joint, JointType::kHelical, {},
                              "the advance along the axis per angle [m/rad]");
  joint.length = ReadParameter(node, "length", joint, JointType::kRod, kPositive,
                               "the distance of the two points [m]");
  if (const auto motion = node.Optional("motion")) ReadMotions(*motion, draft.space, &joint);
  if (const auto cut = node.Optional("cut")) joint.cut = cut->Bool();
  return joint;
}

}  // namespace

const NameList& JointTypeNames() {
  static const NameList kNames = [] {
    std::vector<std::string> names;
    for (int i = 0; i < kNumJointTypes; ++i)
      names.emplace_back(ToString(static_cast<JointType>(i)));
    return names;
  }();
  return kNames;
}

void ReadJoints(const JsonNode& root, Draft* draft) {
  const auto joints = root.Required("joints", "an array of joints");
  if (!joints) return;
  for (const JsonNode& element : joints->Elements("joints")) {
    draft->joints.push_back(ReadJoint(element, *draft));
    draft->joint_names.Add(draft->joints.back().name);
  }
}

}  // namespace loopbench::harness
