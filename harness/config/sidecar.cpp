#include "harness/config/sidecar.h"

#include <fmt/format.h>

#include <Eigen/Geometry>

#include "harness/config/mechanism_sections.h"

namespace loopbench::harness {

namespace {

/// The mechanism so far, and where its bodies stand.
struct Sidecar : Draft {
  const std::vector<Frame>* at_rest = nullptr;
  bool has_gravity = false;
};

/// A joint given on one side: at rest the other is at the same place.
struct Loop : JointDescription {};
using LoopPart = PartOf<Loop>;

void ReadNameOfLoop(const JsonNode& node, LoopPart& loop) {
  loop.name = ReadNewName(node, loop.draft->joint_names);
}

void ReadTypeOfLoop(const JsonNode& node, LoopPart& loop) {
  loop.type = static_cast<JointType>(node.Choice(JointTypeNames(), "a joint type").value_or(0));
  if (!TraitsOf(loop.type).parameter.key.empty() || loop.type == JointType::kFree) {
    node.Fail("a type without a number of its own: others stand in \"joints\"");
  }
}

void ReadFirst(const JsonNode& node, LoopPart& loop) {
  loop.from.body = ReadBodyName(node, *loop.draft).value_or(-1);
}

void ReadSecond(const JsonNode& node, LoopPart& loop) {
  loop.to.body = ReadBodyName(node, *loop.draft).value_or(-1);
  if (loop.to.body >= 0 && loop.to.body == loop.from.body) node.Fail("another body");
}

void ReadPlaceOfLoop(const JsonNode& node, LoopPart& loop) {
  if (loop.from.body < 0) return;
  const BodyDescription& body = loop.draft->bodies[static_cast<std::size_t>(loop.from.body)];
  loop.from.position = ReadPoint(node, body, loop.draft->space);
}

void ReadAxisOfLoop(const JsonNode& node, LoopPart& loop) {
  loop.axis = ReadVector(node, loop.draft->space);
  if (TraitsOf(loop.type).own_axis == '-') {
    node.Fail(fmt::format("no axis of a {} joint", ToString(loop.type)));
  } else if (loop.axis.isZero()) {
    node.Fail("an axis that is not zero");
  }
}

const Fields<LoopPart>& LoopFields() {
  static const Fields<LoopPart> fields(
      "loop", "A joint given on one side, which closes where all coordinates are 0.",
      {{"name", By(TextSchema(), ReadNameOfLoop), "One that no other joint has.", "a name"},
       {"type", By(ChoiceSchema(JointTypeNames().all()), ReadTypeOfLoop), "What it leaves free.",
        "a joint type"},
       {"from", By(TextSchema(), ReadFirst), "A body's name or \"ground\".", "the name of a body"},
       {"to", By(TextSchema(), ReadSecond), "Another.", "the name of a body"},
       {"at", By(PlaceSchema(), ReadPlaceOfLoop), "The joint in axes of `from` [m].",
        "a point of `from`, or coordinates in its axes"},
       {"axis", By(VectorSchema(), ReadAxisOfLoop), "In axes of `from`."}});
  return fields;
}

/// The other side, from where the bodies stand.
void CloseAtRest(const std::vector<Frame>& at_rest, JointDescription* joint) {
  if (joint->from.body < 0 || joint->to.body < 0) return;
  const Frame X_QP = at_rest[static_cast<std::size_t>(joint->to.body)].Inverse() *
                     at_rest[static_cast<std::size_t>(joint->from.body)];
  joint->to.position = X_QP.R * joint->from.position + X_QP.p;
  const Eigen::AngleAxisd turn{Eigen::Quaterniond(X_QP.R)};
  joint->to.rotation = turn.angle() * turn.axis();
  joint->cut = true;
}

void ReadLoops(const JsonNode& node, Sidecar& sidecar) {
  for (const JsonNode& element : node.Elements("loops")) {
    Loop loop;
    loop.from.body = loop.to.body = -1;
    loop = ReadPart(LoopFields(), element, sidecar, loop);
    CloseAtRest(*sidecar.at_rest, &loop);
    sidecar.joints.push_back(loop);
    sidecar.joint_names.Add(loop.name);
  }
}

void ReadGravityOfSidecar(const JsonNode& node, Sidecar& sidecar) {
  sidecar.gravity = ReadVector(node, sidecar.space);
  sidecar.has_gravity = true;
}

const Fields<Sidecar>& SidecarFields() {
  static const Fields<Sidecar> fields(
      "sidecar", "What a description of another program cannot say.",
      {{"comment", By<Sidecar>(TextSchema(), [](const JsonNode& node, Sidecar&) { node.Text(); }),
        "Free text for readers."},
       {"gravity", By(VectorSchema(), ReadGravityOfSidecar), "In place of the file's [m/s^2]."},
       {"loops", By(ArraySchema(LoopFields().Schema()), ReadLoops), "Joints given on one side."},
       {"joints", JointsValue(), "Joints given on both sides."},
       {"forces", ForcesValue(), "Besides gravity."},
       {"initial", Section(InitialFields()), "In place of the file's start."},
       {"observe", Section(ObservationFields()), "Exact facts that observers compare with."}});
  return fields;
}

}  // namespace

SidecarFacts ReadSidecar(const std::filesystem::path& path, const std::vector<Frame>& at_rest,
                         MechanismDescription* description) {
  const std::string text = ReadTextFile(path);
  const Json document = ParseDocument(text, path.string());
  ErrorList errors(path.string(), text);
  Sidecar sidecar;
  static_cast<MechanismDescription&>(sidecar) = *description;
  sidecar.at_rest = &at_rest;
  for (const BodyDescription& body : sidecar.bodies) sidecar.body_names.Add(body.name);
  for (const JointDescription& joint : sidecar.joints) sidecar.joint_names.Add(joint.name);
  SidecarFields().Read(JsonNode(document, "", errors), &sidecar);
  errors.ThrowIfAny();
  *description = static_cast<MechanismDescription&>(sidecar);
  return {sidecar.observe, sidecar.has_gravity};
}

}  // namespace loopbench::harness
