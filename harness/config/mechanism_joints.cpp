// "joints" of a mechanism file.
#include <fmt/format.h>

#include "harness/config/mechanism_sections.h"

namespace loopbench::harness {
namespace {

using Side = PartOf<JointSide>;
using Joint = PartOf<JointDescription>;

/// A number (about z) or a rotation vector of three numbers.
void ReadRotation(const JsonNode& node, Side& side) {
  if (node.value().is_number()) {
    side.rotation = {0.0, 0.0, node.Number()};
    return;
  }
  if (!node.value().is_array() || node.value().size() != 3) {
    node.Fail("a number (rotation about z) or an array of 3 numbers [rad]");
    return;
  }
  side.rotation = node.Vector();
  const bool about_z = side.rotation.x() == 0.0 && side.rotation.y() == 0.0;
  if (side.draft->space == SpaceKind::kPlanar && !about_z) {
    node.FailWithCure(kSpatialCure, "a rotation about z in a planar mechanism");
  }
}

Json WriteRotation(const Side& side) {
  const Eigen::Vector3d& turn = side.rotation;
  if (turn.isZero(0.0)) return Json();
  if (turn.x() == 0.0 && turn.y() == 0.0) return turn.z();
  return {turn.x(), turn.y(), turn.z()};
}

const Fields<Side>& SideFields() {
  static const Json rotation = EitherSchema({NumberSchema(), ArraySchema(NumberSchema(), 3, 3)});
  static const Fields<Side> fields(
      "side", "A frame of a joint, fixed on a body.",
      {{"body", BodyOf<JointSide>(&JointSide::body, true), "A body's name or \"ground\".",
        "the name of a body or \"ground\""},
       {"at", PlaceOf<JointSide>(&JointSide::body, &JointSide::position),
        "Its origin: the name of one of the body's points, or coordinates in body axes [m]."},
       {"rotation", By(rotation, ReadRotation, WriteRotation),
        "Body axes to the joint's frame [rad]: about z, or a rotation vector. Default 0."}});
  return fields;
}

void ReadAxis(const JsonNode& node, Joint& joint) {
  const Eigen::Vector3d axis = joint.axis = node.Vector();
  const JointType type = joint.type;
  if (TraitsOf(type).own_axis == '-') {
    node.Fail(fmt::format("no axis on a {} joint", ToString(type)));
  } else if (axis.isZero()) {
    if (node.value().is_array()) node.Fail("an axis that is not zero");
  } else if (joint.draft->space == SpaceKind::kPlanar) {
    const bool along_z = axis.x() == 0.0 && axis.y() == 0.0 && axis.z() > 0.0;
    if (TraitsOf(type).own_axis == 'z' && !along_z) {
      node.FailWithCure(kSpatialCure, "an axis along +z in a planar mechanism");
    }
    if (TraitsOf(type).own_axis == 'x' && axis.z() != 0.0) {
      node.FailWithCure(kSpatialCure, "an axis with z = 0 in a planar mechanism");
    }
  }
}

Json WriteAxis(const Joint& joint) {
  return joint.axis.isZero(0.0) ? Json() : WriteVector(joint.axis, joint.draft->space);
}

Range RangeOf(const JointParameter& parameter) { return parameter.positive ? kPositive : Range{}; }

/// A number that joints of some types must have and no other may.
struct ParameterKey {
  JointParameter parameter;
  std::vector<std::string> types;
};

std::vector<ParameterKey> ParameterKeys() {
  std::vector<ParameterKey> keys;
  for (const JointTraits& traits : AllJointTraits()) {
    if (traits.parameter.key.empty()) continue;
    auto known = std::ranges::find(keys, traits.parameter.key,
                                   [](const ParameterKey& other) { return other.parameter.key; });
    if (known == keys.end()) known = keys.insert(keys.end(), {traits.parameter, {}});
    known->types.emplace_back(traits.name);
  }
  return keys;
}

void ReadParameter(const JsonNode& node, Joint& joint) {
  static const std::vector<ParameterKey> keys = ParameterKeys();
  const JointParameter& own = TraitsOf(joint.type).parameter;
  for (const ParameterKey& known : keys) {
    const std::string key(known.parameter.key);
    if (key == own.key) {
      const auto found = node.Required(key, own.meaning);
      joint.parameter = found ? found->Number(RangeOf(own)) : 1.0;
    } else if (const auto found = node.Optional(key)) {
      found->Fail(fmt::format("no {} on a {} joint", key, ToString(joint.type)));
    }
  }
}

/// A motion of a joint with `speeds` coordinates that may be prescribed, of which some are.
struct MotionOfJoint : PrescribedMotion {
  int speeds = 1;
  const std::vector<PrescribedMotion>* taken = nullptr;
};

void ReadCoordinate(const JsonNode& node, MotionOfJoint& motion) {
  motion.coordinate = static_cast<int>(node.Integer(0, motion.speeds - 1));
  for (const PrescribedMotion& other : *motion.taken) {
    if (other.coordinate == motion.coordinate) node.Fail("a coordinate not yet prescribed");
  }
}

Json WriteCoordinate(const MotionOfJoint& motion) { return motion.coordinate; }

const Fields<MotionOfJoint>& MotionFields() {
  constexpr int kMostCoordinates = 3;  // that can be prescribed: those of a planar joint
  static const Fields<MotionOfJoint> fields(
      "motion", "A coordinate as a given function of time.",
      {{"coordinate", By(IntegerSchema(0, kMostCoordinates - 1), ReadCoordinate, WriteCoordinate),
        "In the order of initial coordinates, from 0.", "the number of a coordinate"},
       {"value", TimeFunctionOf(&PrescribedMotion::value), "Its value [rad or m].",
        "a number or a function of time"}});
  return fields;
}

/// One function for a joint with one coordinate, else a list that names coordinates.
void ReadMotions(const JsonNode& node, Joint& joint) {
  const SpaceKind space = joint.draft->space;
  const int speeds = NumValues(joint.type, space, true);
  if (speeds == 0 || NumValues(joint.type, space, false) != speeds) {
    node.FailAs(fmt::format("a motion of a {} joint", ToString(joint.type)),
                "a joint whose coordinates are angles and shifts");
    return;
  }
  if (!node.value().is_array()) {
    if (speeds > 1) {
      node.Fail(
          fmt::format("an array of {{\"coordinate\", \"value\"}}: a {} joint has {} coordinates",
                      ToString(joint.type), speeds));
      return;
    }
    joint.motions = {{0, ReadTimeFunction(node)}};
    return;
  }
  for (const JsonNode& element : node.Elements("motions")) {
    MotionOfJoint motion{{0, Polynomial{{0.0}}}, speeds, &joint.motions};
    MotionFields().Read(element, &motion);
    joint.motions.push_back(motion);
  }
}

Json WriteMotions(const Joint& joint) {
  if (joint.motions.empty()) return Json();
  if (NumValues(joint.type, joint.draft->space, true) == 1) {
    return WriteTimeFunction(joint.motions[0].value);
  }
  Json motions = Json::array();
  for (const PrescribedMotion& motion : joint.motions) {
    motions.push_back(MotionFields().Write(MotionOfJoint{motion}));
  }
  return motions;
}

bool IsMissingInPlane(const Joint& joint) {
  return joint.draft->space == SpaceKind::kPlanar && !TraitsOf(joint.type).in_plane;
}

void ReadType(const JsonNode& node, Joint& joint) {
  joint.type = static_cast<JointType>(node.Choice(JointTypeNames(), "a joint type").value_or(0));
  if (IsMissingInPlane(joint)) node.FailWithCure(kSpatialCure, "a joint of the plane");
}

Json WriteType(const Joint& joint) { return std::string(ToString(joint.type)); }

void CheckSides(const JsonNode& node, Joint& joint) {
  if (joint.from.body < 0 || joint.from.body != joint.to.body) return;
  node.FailAs(
      fmt::format("a joint of \"{}\" with itself", joint.draft->bodies[joint.from.body].name),
      "two different bodies");
}

/// Keys that joints of some types must have and others may not, and the rule that says so.
void AddParameters(std::vector<Field<Joint>>* rows) {
  Json rules = Json::array();
  for (const auto& [parameter, types] : ParameterKeys()) {
    const std::string key(parameter.key);
    const auto write = [key](const Joint& joint) {
      return TraitsOf(joint.type).parameter.key == key ? Json(joint.parameter) : Json();
    };
    rows->push_back(
        {key, FieldValue<Joint>(NumberSchema(RangeOf(parameter)), nullptr, nullptr, write),
         fmt::format("Of a {} joint: {}.", fmt::join(types, " or "), parameter.meaning)});
    rules.push_back({{"if", {{"properties", {{"type", ChoiceSchema(types)}}}}},
                     {"then", Requires({key})},
                     {"else", {{"not", Requires({key})}}}});
  }
  rows->push_back({"", By({{"allOf", rules}}, ReadParameter)});
}

void ReadNameOfJoint(const JsonNode& node, Joint& joint) {
  joint.name = ReadNewName(node, joint.draft->joint_names);
}

Json WriteNameOfJoint(const Joint& joint) { return joint.name; }

Fields<Joint> MakeJointFields() {
  const Json motions = EitherSchema({TimeFunctionSchema(), ArraySchema(MotionFields().Schema())});
  std::vector<Field<Joint>> rows = {
      {"name", By(TextSchema(), ReadNameOfJoint, WriteNameOfJoint), "One that no other joint has.",
       "a name"},
      {"type", By(ChoiceSchema(JointTypeNames().all()), ReadType, WriteType),
       "What it leaves free.", "a joint type", IsMissingInPlane},
      {"from", Part(&JointDescription::from, SideFields()), "Where F is.",
       "an object with keys \"body\", \"at\", \"rotation\""},
      {"to", Part(&JointDescription::to, SideFields()), "Where M is.",
       "an object with keys \"body\", \"at\", \"rotation\""},
      {"", By(Json::object(), CheckSides)},
      {"axis", By(VectorSchema(), ReadAxis, WriteAxis),
       "Of a revolute (default z) or prismatic joint (default x), not zero."}};
  AddParameters(&rows);
  rows.push_back({"motion", By(motions, ReadMotions, WriteMotions),
                  "Coordinates as given functions of time [rad or m]: one function for a joint "
                  "with one coordinate, else a list."});
  rows.push_back({"cut", Bool(&JointDescription::cut),
                  "This joint closes its loop: it carries no joint coordinate."});
  return {"joint", "From frame F on one body to frame M on another.", std::move(rows)};
}

const Fields<Joint>& JointFields() {
  static const Fields<Joint> fields = MakeJointFields();
  return fields;
}

void ReadJoints(const JsonNode& node, Draft& draft) {
  JointDescription unread;
  unread.from.body = unread.to.body = -1;  // not known: matches no other side
  for (const JsonNode& element : node.Elements("joints")) {
    draft.joints.push_back(ReadPart(JointFields(), element, draft, unread));
    draft.joint_names.Add(draft.joints.back().name);
  }
}

Json WriteJoints(const Draft& draft) {
  Json joints = Json::array();
  for (const JointDescription& joint : draft.joints) {
    joints.push_back(WritePart(JointFields(), draft, joint));
  }
  return joints;
}

}  // namespace

const NameList& JointTypeNames() {
  static const NameList kNames = [] {
    std::vector<std::string> names;
    for (const JointTraits& traits : AllJointTraits()) names.emplace_back(traits.name);
    return names;
  }();
  return kNames;
}

FieldValue<Draft> JointsValue() {
  return By(ArraySchema(JointFields().Schema()), ReadJoints, WriteJoints);
}

}  // namespace loopbench::harness
