// "initial", "independent" and "observe" of a mechanism file.
#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "harness/config/mechanism_sections.h"
#include "harness/text/spelling.h"

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

std::vector<JointValues> ReadJointValues(const JsonNode& section, const Draft& draft, bool speeds) {
  std::vector<JointValues> result;
  if (!section.ExpectObject(draft.joint_names)) return result;
  for (const auto& [name, node] : section.Members()) {
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

/// One number, or as many as there are. Those of joints that follow a given motion say nothing, and
/// no file has them.
Json WriteJointValues(const Draft& draft, const std::vector<JointValues>& list, bool speeds) {
  Json written = Json::object();
  for (const JointValues& one : list) {
    const JointDescription& joint = draft.joints[one.joint];
    const int count = NumValues(joint.type, draft.space, speeds);
    if (count == 1 && !joint.motions.empty()) continue;
    written[joint.name] = count == 1 ? Json(one.values[0]) : Json(one.values);
  }
  return written.empty() ? Json() : written;
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

using Form = PartOf<PendulumForm>;

void ReadFormType(const JsonNode& node, Form&) { node.Choice({"pendulum"}, "a closed form"); }

Json WriteFormType(const Form&) { return "pendulum"; }

void ReadFormBody(const JsonNode& node, Form& form) {
  const auto index = ReadBodyName(node, *form.draft);
  if (index) form.body = form.draft->bodies[*index].name;
}

Json WriteFormBody(const Form& form) { return form.body; }

const Fields<Form>& PendulumFields() {
  static const Fields<Form> fields(
      "closed_form", "The exact motion of one body: that of a plain pendulum.",
      {{"type", By(ChoiceSchema({"pendulum"}), ReadFormType, WriteFormType), "What it is.",
        "\"pendulum\""},
       {"body", By(TextSchema(), ReadFormBody, WriteFormBody), "Whose angle it is.",
        "the name of a body"},
       {"down_angle", Number(&PendulumForm::down_angle),
        "Absolute angle of the body where theta = 0 [rad].", "a number [rad]"},
       {"frequency_squared", Number(&PendulumForm::frequency_squared, kPositive),
        "In theta'' = -frequency_squared sin(theta) [1/s^2].", "a number > 0 [1/s^2]"}});
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

void ReadHeld(const JsonNode& node, Draft& draft) {
  std::set<int> given, known;
  for (const JointValues& values : draft.initial.coordinates) given.insert(values.joint);
  for (const JsonNode& element : node.Elements("joint names")) {
    const auto joint = ReadJointName(element, draft);
    if (!joint) continue;
    if (!given.contains(*joint)) element.Fail("a joint with a value in /initial/coordinates");
    if (!known.insert(*joint).second) element.Fail("each joint once");
    draft.initial.held.push_back(*joint);
  }
}

Json WriteHeld(const Draft& draft) {
  Json held = Json::array();
  for (const int index : draft.initial.held) {
    const JointDescription& joint = draft.joints[index];
    const bool is_driven = !joint.motions.empty() && NumValues(joint.type, draft.space, false) == 1;
    if (!is_driven) held.push_back(joint.name);
  }
  return held.empty() ? Json() : held;
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

Json WriteIndependent(const Draft& draft) {
  return draft.independent.empty() ? Json() : Json(draft.independent);
}

/// Names, each once.
Json NamesSchema() {
  Json schema = ArraySchema(TextSchema());
  schema["uniqueItems"] = true;
  return schema;
}

void ReadCoordinates(const JsonNode& node, Draft& draft) {
  draft.initial.coordinates = ReadJointValues(node, draft, false);
}

Json WriteCoordinates(const Draft& draft) {
  return WriteJointValues(draft, draft.initial.coordinates, false);
}

void ReadSpeeds(const JsonNode& node, Draft& draft) {
  draft.initial.speeds = ReadJointValues(node, draft, true);
}

Json WriteSpeeds(const Draft& draft) { return WriteJointValues(draft, draft.initial.speeds, true); }

void ReadBranch(const JsonNode& node, Draft& draft) {
  for (const JsonNode& element : node.Elements("combinations of body angles")) {
    draft.observe.branch_invariants.push_back(ReadCombination(element, draft));
  }
}

Json WriteBranch(const Draft& draft) {
  Json branch = Json::array();
  for (const AngleCombination& combination : draft.observe.branch_invariants) {
    Json& written = branch.emplace_back(Json::object());
    for (const auto& [body, coefficient] : combination) written[body] = coefficient;
  }
  return branch.empty() ? Json() : branch;
}

void ReadClosedForm(const JsonNode& node, Draft& draft) {
  draft.observe.closed_form = ReadPart(PendulumFields(), node, draft);
}

Json WriteClosedForm(const Draft& draft) {
  const std::optional<PendulumForm>& form = draft.observe.closed_form;
  return form ? WritePart(PendulumFields(), draft, *form) : Json();
}

void ReadLength(const JsonNode& node, Draft& draft) {
  draft.observe.length = node.Number(kPositive);
}

Json WriteLength(const Draft& draft) {
  const double length = draft.observe.length;
  return length == SceneObservation{}.length ? Json() : Json(length);
}

}  // namespace

FieldValue<Draft> IndependentValue() {
  return By(NamesSchema(), ReadIndependent, WriteIndependent);
}

const Fields<Draft>& InitialFields() {
  constexpr std::size_t kMostValues = 7;  // of a free joint in space
  static const Json values =
      Named("jointValues",
            MapSchema(EitherSchema({NumberSchema(), ArraySchema(NumberSchema(), 1, kMostValues)})));
  static const Fields<Draft> fields(
      "initial", "Where and how fast it starts; what is not said is assembled.",
      {{"coordinates", By(values, ReadCoordinates, WriteCoordinates),
        "By joint: guesses, or exact where the joint is held. Revolute [rad], prismatic [m], free "
        "joint [angle, x, y] in the plane, [qw, qx, qy, qz, x, y, z] in space."},
       {"speeds", By(values, ReadSpeeds, WriteSpeeds),
        "By joint; all of them are held when the loops are assembled."},
       {"held", By(NamesSchema(), ReadHeld, WriteHeld),
        "Joints whose coordinates the assembly must not move."}});
  return fields;
}

const Fields<Draft>& ObservationFields() {
  static const Fields<Draft> fields(
      "observe", "Exact facts that observers compare with.",
      {{"branch", By(ArraySchema(MapSchema(NumberSchema(), 1)), ReadBranch, WriteBranch),
        "Linear combinations of absolute body angles, by body, that stay constant on the right "
        "branch."},
       {"closed_form", By(PendulumFields().Schema(), ReadClosedForm, WriteClosedForm)},
       {"length", By(NumberSchema(kPositive), ReadLength, WriteLength),
        "Characteristic bar length [m], default 1."}});
  return fields;
}

}  // namespace loopbench::harness
