#include "harness/config/mechanism_reader.h"

#include <set>

#include "harness/base/text.h"
#include "harness/config/file_schemas.h"
#include "harness/config/mechanism_sections.h"
#include "mechanism/start/poses.h"

namespace loopbench::harness {

Eigen::Vector3d ReadVector(const JsonNode& node, const Draft& draft) {
  const Eigen::Vector3d vector = node.Vector();
  // moments of inertia contain squares, which must not overflow
  if (!(vector.cwiseAbs().maxCoeff() < 1e100)) node.Fail("numbers of sizes below 1e100");
  if (draft.space == SpaceKind::kPlanar && vector.z() != 0.0) {
    node.FailWithCure(kSpatialCure, "z = 0 in a planar mechanism");
  }
  return vector;
}

Json WriteVector(const Eigen::Vector3d& vector, const Draft& draft) {
  Json json = {vector.x(), vector.y()};
  if (draft.space == SpaceKind::kSpatial || vector.z() != 0.0) json.push_back(vector.z());
  return json;
}

Json WritePoint(const Eigen::Vector3d& at, int body, const Draft& draft) {
  for (const auto& [name, point] : draft.bodies[body].points) {
    if (point == at) return name;
  }
  return UnlessZero<WriteVector>(at, draft);
}

Eigen::Vector3d ReadPoint(const JsonNode& node, int index, const Draft& draft) {
  const BodyDescription& body = draft.bodies[index];
  if (node.value().is_array()) return ReadVector(node, draft);
  if (node.value().is_string()) {
    const auto point = body.points.find(node.value().get_ref<const std::string&>());
    if (point != body.points.end()) return point->second;
  }
  NameList names;
  for (const auto& [name, position] : body.points) {
    if (!node.errors().full()) names.Add(name);
  }
  if (names.all().empty()) {
    node.Fail(fmt::format("coordinates: \"{}\" has no points", body.name));
  } else {
    node.Choice(names, fmt::format("coordinates or a point of \"{}\"", body.name));
  }
  return Eigen::Vector3d::Zero();
}

std::optional<int> ReadBodyName(const JsonNode& node, const Draft& draft) {
  return node.Choice(draft.body_names, "a body");
}

std::optional<int> ReadJointName(const JsonNode& node, const Draft& draft) {
  return node.Choice(draft.joint_names, "a joint");
}

Eigen::Vector3d ReadRotation(const JsonNode& node, const Draft& draft) {
  if (node.value().is_number()) return {0.0, 0.0, node.Number()};
  if (!node.value().is_array() || node.value().size() != 3) {
    node.Fail("a number (rotation about z) or an array of 3 numbers [rad]");
    return Eigen::Vector3d::Zero();
  }
  const Eigen::Vector3d turn = node.Vector();
  if (draft.space == SpaceKind::kPlanar && (turn.x() != 0.0 || turn.y() != 0.0)) {
    node.FailWithCure(kSpatialCure, "a rotation about z in a planar mechanism");
  }
  return turn;
}

Json WriteRotation(const Eigen::Vector3d& turn, const Draft&) {
  if (turn.x() == 0.0 && turn.y() == 0.0) return turn.z();
  return {turn.x(), turn.y(), turn.z()};
}

Json RotationSchema() { return EitherSchema({NumberSchema(), ArraySchema(NumberSchema(), 3, 3)}); }

Json PlaceSchema() { return Named("place", EitherSchema({TextSchema(), VectorSchema()})); }

// "initial", "independent", "observe" and "expect" of a mechanism file.

namespace {

constexpr std::int64_t kMostFreedom = 1'000'000;

/// Reads one number for a joint with one coordinate, otherwise one per coordinate.
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

/// Returns the values of a section by joint; reports names of no joint.
std::vector<std::pair<int, JsonNode>> ByJoint(const JsonNode& section, const Draft& draft) {
  std::vector<std::pair<int, JsonNode>> values;
  if (!section.ExpectObject(draft.joint_names)) return values;
  for (const auto& [name, node] : section.Members()) {
    if (const auto joint = draft.joint_names.Find(name)) values.emplace_back(*joint, node);
  }
  return values;
}

/// Reports zero quaternions. Other lengths are allowed: quaternions are normalised on use.
void CheckQuaternion(const JsonNode& node, const std::vector<double>& values) {
  const auto zeros = std::count(values.begin(), std::min(values.begin() + 4, values.end()), 0.0);
  if (zeros == 4) node.Fail("a quaternion qw, qx, qy, qz that is not zero");
}

/// Returns the field of the coordinates or speeds of joints: one number or several by joint. Values
/// of joints with prescribed motion are not written.
PartValue<InitialDescription> JointValuesOf(std::vector<JointValues> InitialDescription::*list,
                                            bool speeds) {
  constexpr std::size_t kMaxValues = 7;  // free joint in space
  static const Json schema =
      Named("jointValues",
            MapSchema(EitherSchema({NumberSchema(), ArraySchema(NumberSchema(), 1, kMaxValues)})));
  const auto read = [=](const JsonNode& section, const Draft& draft) {
    std::vector<JointValues> result;
    for (const auto& [joint, node] : ByJoint(section, draft)) {
      const JointDescription& described = draft.joints[joint];
      const int expected = NumValues(described.type, draft.space, speeds);
      if (expected == 1 && !described.motions.empty()) {
        node.FailAs(fmt::format("a value of \"{}\", whose motion is prescribed", described.name),
                    "none");
        continue;
      }
      result.push_back({joint, ReadJointNumbers(node, described, draft.space, speeds)});
      const bool quaternion = expected > NumValues(described.type, draft.space, true);
      if (quaternion) CheckQuaternion(node, result.back().values);
    }
    return result;
  };
  const auto write = [=](const std::vector<JointValues>& values, const Draft& draft) {
    Json written = Json::object();
    for (const JointValues& one : values) {
      const JointDescription& joint = draft.joints[one.joint];
      const int count = NumValues(joint.type, draft.space, speeds);
      if (count == 1 && !joint.motions.empty()) continue;
      written[joint.name] = count == 1 ? Json(one.values[0]) : Json(one.values);
    }
    return written;
  };
  return Coded<InitialDescription>(list, schema, read, write);
}

/// Names of speeds: joints with one speed, and owners of several speeds, named
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
  // Components in the plane and in space: a planar file may be run in either.
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

const PartFields<PendulumForm>& PendulumFields() {
  using Form = PendulumForm;
  const auto read_body = [](const JsonNode& node, const Draft& draft) {
    const auto index = ReadBodyName(node, draft);
    return index ? draft.bodies[*index].name : "";
  };
  const auto write_body = [](const std::string& body, const Draft&) { return Json(body); };
  static const PartFields<Form> fields(
      "closed_form", "Closed-form motion of one body: a simple pendulum.",
      {{"type", Constant<Form>("pendulum", "a closed form"), "Closed-form type.", "\"pendulum\""},
       {"body", Coded<Form>(&Form::body, TextSchema(), read_body, write_body),
        "Body whose angle is theta.", "the name of a body"},
       {"down_angle", Number(&Form::down_angle), "Absolute angle of the body at theta = 0 [rad].",
        "a number [rad]"},
       {"frequency_squared", Number(&Form::frequency_squared, kPositive),
        "Factor in theta'' = -frequency_squared sin(theta) [1/s^2].", "a number > 0 [1/s^2]"}});
  return fields;
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

void ReadHeld(const JsonNode& node, InitialDescription& initial, const Draft& draft) {
  std::set<int> given, known;
  for (const JointValues& values : initial.coordinates) given.insert(values.joint);
  for (const JsonNode& element : node.Elements("joint names")) {
    const auto joint = ReadJointName(element, draft);
    if (!joint) continue;
    if (!given.contains(*joint)) element.Fail("a joint with a value in /initial/coordinates");
    if (!known.insert(*joint).second) element.Fail("each joint once");
    initial.held.push_back(*joint);
  }
}

Json WriteHeld(const InitialDescription& initial, const Draft& draft) {
  Json held = Json::array();
  for (const int index : initial.held) {
    const JointDescription& joint = draft.joints[index];
    const bool is_driven = !joint.motions.empty() && NumValues(joint.type, draft.space, false) == 1;
    if (!is_driven) held.push_back(joint.name);
  }
  return held;
}

void ReadIndependent(const JsonNode& node, Draft& draft) {
  const SpeedNames names = NamesOfSpeeds(draft);
  std::set<std::string> known;
  for (const JsonNode& element : node.Elements("names")) {
    const std::string name = element.Text();
    if (name.empty()) continue;
    CheckIndependentName(element, name, names);
    if (!known.insert(name).second) element.Fail("each name once");
    draft.independent.push_back(name);
  }
}

Json WriteIndependent(const Draft& draft) { return draft.independent; }

/// Returns the schema of unique names.
Json NamesSchema() {
  Json schema = ArraySchema(TextSchema());
  schema["uniqueItems"] = true;
  return schema;
}

void ReadWeights(const JsonNode& node, InitialDescription& initial, const Draft& draft) {
  for (const auto& [joint, weight] : ByJoint(node, draft)) {
    const auto guess = std::ranges::find(initial.coordinates, joint, &JointValues::joint);
    if (guess == initial.coordinates.end()) {
      weight.Fail("the weight of a joint with a value in /initial/coordinates");
    } else {
      guess->weight = weight.Number(kPositive);
    }
  }
}

Json WriteWeights(const InitialDescription& initial, const Draft& draft) {
  Json weights = Json::object();
  for (const JointValues& guess : initial.coordinates) {
    if (guess.weight != 1.0) weights[draft.joints[guess.joint].name] = guess.weight;
  }
  return weights;
}

void CheckTarget(const JsonNode& node, PoseTarget& target) {
  if (!target.at && !target.rotation) node.FailAs("neither", "\"at\", \"rotation\" or both");
}

/// Writes a value that may be absent.
template <Json (*write)(const Eigen::Vector3d&, const Draft&)>
Json IfAny(const std::optional<Eigen::Vector3d>& vector, const Draft& draft) {
  return vector ? write(*vector, draft) : Json();
}

const PartFields<PoseTarget>& TargetFields() {
  using Target = PoseTarget;
  static const PartFields<Target> fields(
      "pose", "Pose of a body at the start, or position of one of its points.",
      {{"body", BodyOf<Target>(&Target::body, false), "Name of the body.", "the name of a body"},
       {"point", PlaceOf<Target>(&Target::body, &Target::point),
        "A point of the body by name, or body coordinates [m]. Default: body origin."},
       {"at", Coded<Target>(&Target::at, VectorSchema(), ReadVector, IfAny<WriteVector>),
        "Position of the point in ground axes [m]."},
       {"rotation",
        Coded<Target>(&Target::rotation, RotationSchema(), ReadRotation, IfAny<WriteRotation>),
        "Rotation of the body's axes from ground axes [rad]: angle about z, or rotation vector."},
       {"fixed", Bool(&Target::fixed), "If true, the start meets it exactly."},
       {"weight", Number(&Target::weight, kPositive),
        "Weight of the distance from a target that is not fixed."},
       {"", By(Json::object(), CheckTarget)}});
  return fields;
}

void ReadBranch(const JsonNode& node, ObservedQuantities& observe, const Draft& draft) {
  for (const JsonNode& element : node.Elements("combinations of body angles")) {
    observe.branch_invariants.push_back(ReadCombination(element, draft));
  }
}

Json WriteBranch(const ObservedQuantities& observe, const Draft&) {
  Json branch = Json::array();
  for (const AngleCombination& combination : observe.branch_invariants) {
    Json& written = branch.emplace_back(Json::object());
    for (const auto& [body, coefficient] : combination) written[body] = coefficient;
  }
  return branch;
}

void ReadLength(const JsonNode& node, ObservedQuantities& observe) {
  observe.length = node.Number(kPositive);
}

Json WriteLength(const ObservedQuantities& observe) {
  return observe.length == ObservedQuantities{}.length ? Json() : Json(observe.length);
}

void ReadFreedom(const JsonNode& node, Expectation& expected) {
  expected = {static_cast<int>(node.Integer(0, kMostFreedom)), node.Place()};
}

const Fields<Expectation>& ExpectationFields() {
  static const Fields<Expectation> fields(
      "expect",
      "Properties that the mechanism must have; `check`, `explain` and `run` verify them.",
      {{"degrees_of_freedom",
        By<Expectation>(IntegerSchema(0, kMostFreedom), ReadFreedom,
                        [](const Expectation& e) { return Json(e.degrees_of_freedom); }),
        "Independent finite motions; prescribed coordinates do not count.", "an integer from 0"}});
  return fields;
}

// without bodies, every reference to a body would be a consequential error
bool HasNoBodies(const Draft& draft, const Draft&) { return draft.bodies.size() < 2; }

/// Assembles a file with targets and takes over the coordinates of the result.
void MeetTargets(const JsonNode& root, Draft& draft) {
  if (draft.initial.poses.empty() || !root.errors().empty() || !Validate(draft).empty()) return;
  const std::string why = ResolvePoses(&draft);
  if (why.empty()) return;
  root.Optional("initial")->Optional("poses")->FailAs(why, "targets that the loops allow");
}

const PartFields<Draft>& MechanismFileFields() {
  static const PartFields<Draft> fields(
      "mechanism",
      "Bodies, joints, forces and initial values in SI units; angles in rad. The program also "
      "checks that names exist, that inertias are positive definite and physically possible, and "
      "that each joint has as many values as coordinates.",
      DocumentRows<Draft, const Draft>(
          {{"name", Text(&Draft::name), "Name of the mechanism.", "a name"},
           {"comment", Text(&Draft::comment), "Free text for readers."},
           {"space", Choice(&Draft::space, {"planar", "spatial"}, "a space"),
            "planar: all motion is in the x-y plane, and third components are 0."},
           {"gravity", Coded<Draft>(&Draft::gravity, VectorSchema(), ReadVector, WriteVector),
            "Acceleration of gravity [m/s^2] in ground axes.",
            "an array of 2 or 3 numbers [m/s^2]"},
           {"ground", GroundValue()},
           {"bodies", BodiesValue(), "Moving bodies.", "an array of bodies", HasNoBodies},
           {"joints", JointsValue(), "Joints between the bodies.", "an array of joints"},
           {"couplings", CouplingsValue(),
            "Linear relations of joint coordinates: gears, racks, differentials."},
           {"forces", ForcesValue(), "Forces other than gravity."},
           {"initial", Object(&Draft::initial, InitialFields())},
           {"independent", By(NamesSchema(), ReadIndependent, WriteIndependent),
            "Independent speeds of the fixed coordinate reduction: joint names for joint "
            "coordinates, \"<body>.angle\", \"<body>.x\", ... for absolute coordinates."},
           {"accuracy", Number(&Draft::accuracy, {.min = 0.0, .max = 0.1, .above_min = true}),
            "Accuracy of points, axes and initial values [rad, or lengths of the mechanism]. "
            "Loops with smaller gaps are closed; constraints with smaller differences are "
            "redundant."},
           {"known_solution", Section(ObservationFields())},
           {"expect", OptionalObject(&Draft::expected, ExpectationFields())}}));
  return fields;
}

void RefuseReleased(const MechanismDescription& description) {
  for (const JointDescription& joint : description.joints) {
    if (joint.released.empty()) continue;
    throw ConfigError(fmt::format(
        "{}: joint \"{}\": found released directions, expected none: mechanism files cannot "
        "contain them",
        description.name, joint.name));
  }
}

}  // namespace

const PartFields<InitialDescription>& InitialFields() {
  static const PartFields<InitialDescription> fields(
      "initial", "Initial coordinates and speeds. Missing values are found by assembly.",
      {{"coordinates", JointValuesOf(&InitialDescription::coordinates, false),
        "Guesses by joint, or exact values for \"fixed\" joints. Revolute [rad], prismatic [m], "
        "free joint [angle, x, y] in the plane, [qw, qx, qy, qz, x, y, z] in space."},
       {"speeds", JointValuesOf(&InitialDescription::speeds, true),
        "Speeds by joint [rad/s or m/s]. The assembly of the loops keeps all of them."},
       {"fixed", By(NamesSchema(), ReadHeld, WriteHeld),
        "Joints whose coordinates the assembly keeps."},
       {"weights", By(MapSchema(NumberSchema(kPositive)), ReadWeights, WriteWeights),
        "Weights of guesses by joint; default: 1. The start minimises the sum of squares of weight "
        "times difference [rad, or mean lengths of links]."},
       {"poses", ObjectList(&InitialDescription::poses, TargetFields(), "poses"),
        "Poses of bodies and positions of points that the start meets, or comes near to."}});
  return fields;
}

const PartFields<ObservedQuantities>& ObservationFields() {
  static const PartFields<ObservedQuantities> fields(
      "known_solution", "Known exact properties of the motion, for error measures.",
      {{"branch", By(ArraySchema(MapSchema(NumberSchema(), 1)), ReadBranch, WriteBranch),
        "Linear combinations of absolute body angles, by body, that are constant on the correct "
        "branch."},
       {"closed_form", OptionalObject(&ObservedQuantities::closed_form, PendulumFields())},
       {"length", By(NumberSchema(kPositive), ReadLength, WriteLength),
        "Characteristic bar length [m]; default: 1."}});
  return fields;
}

Json MechanismSchema() { return MechanismFileFields().OwnSchema(); }

MechanismFile ReadMechanism(const std::filesystem::path& path) {
  return ParseMechanism(ReadTextFile(path), path.string());
}

MechanismFile ParseMechanism(std::string_view text, const std::string& file) {
  return ReadDocument(text, file, ReadMechanismObject);
}

MechanismFile ReadMechanismObject(const JsonNode& root) {
  MechanismFile result;
  result.canonical = CompactText(root.value());
  Draft draft;
  draft.bodies[kGround].name = "ground";
  draft.body_names.Add("ground");
  if (ExpectDocument(root, FileKind::kMechanism)) {
    MechanismFileFields().ReadRows(root, &draft, draft);
    MeetTargets(root, draft);
  }
  result.observe = std::move(static_cast<ObservedQuantities&>(draft));
  result.description = std::move(static_cast<MechanismDescription&>(draft));
  return result;
}

std::string MechanismText(const MechanismDescription& description,
                          const ObservedQuantities& observe, const std::string& comment) {
  RefuseReleased(description);
  Draft draft;
  static_cast<MechanismDescription&>(draft) = description;
  draft.bodies[kGround].name = "ground";
  static_cast<ObservedQuantities&>(draft) = observe;
  draft.comment = comment;
  std::string text = JsonText(MechanismFileFields().Write(draft, draft));
  ParseMechanism(text, description.name + " (written)");
  return text;
}

}  // namespace loopbench::harness
