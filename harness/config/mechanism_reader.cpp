#include "harness/config/mechanism_reader.h"

#include <fmt/format.h>

#include <utility>

#include "harness/config/file_schemas.h"
#include "harness/config/mechanism_sections.h"
#include "harness/json/document_kind.h"

namespace loopbench::harness {

Eigen::Vector3d ReadVector(const JsonNode& node, SpaceKind space) {
  const Eigen::Vector3d vector = node.Vector();
  if (space == SpaceKind::kPlanar && vector.z() != 0.0) {
    node.FailWithCure(kSpatialCure, "z = 0 in a planar mechanism");
  }
  return vector;
}

Json WriteVector(const Eigen::Vector3d& vector, SpaceKind space) {
  Json json = {vector.x(), vector.y()};
  if (space == SpaceKind::kSpatial || vector.z() != 0.0) json.push_back(vector.z());
  return json;
}

Json WritePoint(const Eigen::Vector3d& at, const BodyDescription& body, SpaceKind space) {
  for (const auto& [name, point] : body.points) {
    if (point == at) return name;
  }
  return at.isZero(0.0) ? Json() : WriteVector(at, space);
}

Eigen::Vector3d ReadPoint(const JsonNode& node, const BodyDescription& body, SpaceKind space) {
  if (node.value().is_array()) return ReadVector(node, space);
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

std::string ReadNewName(const JsonNode& node, const NameList& taken) {
  std::string name = node.Text();
  if (taken.Find(name)) node.Fail("a name that is not in use yet");
  return name;
}

Json PlaceSchema() { return Named("place", EitherSchema({TextSchema(), VectorSchema()})); }

namespace {

void ReadComment(const JsonNode& node, Draft& draft) { draft.comment = node.Text(); }

Json WriteComment(const Draft& draft) {
  return draft.comment.empty() ? Json() : Json(draft.comment);
}

void ReadGravity(const JsonNode& node, Draft& draft) {
  draft.gravity = ReadVector(node, draft.space);
}

Json WriteGravity(const Draft& draft) { return WriteVector(draft.gravity, draft.space); }

// without bodies everything that names one would be a mistake, and none of its own
bool HasNoBodies(const Draft& draft) { return draft.bodies.size() < 2; }

}  // namespace

const Fields<Draft>& MechanismFileFields() {
  static const Fields<Draft> fields(
      "mechanism",
      "Bodies, joints, forces and initial values; SI units, angles in rad. The program checks "
      "more than this schema: that names exist, that inertias are positive definite and those of "
      "a body, that each joint gets as many values as it has coordinates.",
      DocumentRows<Draft>(
          {{"name", Text(&Draft::name), "Of the scene.", "a name"},
           {"comment", By(TextSchema(), ReadComment, WriteComment), "Free text for readers."},
           {"space", Choice(&Draft::space, {"planar", "spatial"}, "a space"),
            "Planar: everything moves in the x-y plane, third components are 0."},
           {"gravity", By(VectorSchema(), ReadGravity, WriteGravity),
            "Acceleration of gravity [m/s^2] in ground axes.",
            "an array of 2 or 3 numbers [m/s^2]"},
           {"ground", GroundValue()},
           {"bodies", BodiesValue(), "All that moves.", "an array of bodies", HasNoBodies},
           {"joints", JointsValue(), "What holds bodies together, and lets them move.",
            "an array of joints"},
           {"forces", ForcesValue(), "Besides gravity."},
           {"initial", Section(InitialFields())},
           {"independent", IndependentValue(),
            "Speeds that the fixed coordinate reduction takes as independent: joint names for "
            "joint "
            "coordinates, \"<body>.angle\", \"<body>.x\", ... for absolute ones."},
           {"accuracy", Number(&Draft::accuracy, kPositive),
            "Accuracy of points, axes and initial values [rad, or lengths of the mechanism]. Loops "
            "that close within it are closed; constraints that differ by less are redundant."},
           {"observe", Section(ObservationFields())}}));
  return fields;
}

Json MechanismSchema() { return MechanismFileFields().OwnSchema(); }

MechanismFile ReadMechanism(const std::filesystem::path& path) {
  return ParseMechanism(ReadTextFile(path), path.string());
}

MechanismFile ParseMechanism(std::string_view text, const std::string& file) {
  const Json document = ParseDocument(text, file);
  ErrorList errors(file, text);
  MechanismFile result = ReadMechanismObject(JsonNode(document, "", errors));
  errors.ThrowIfAny();
  return result;
}

MechanismFile ReadMechanismObject(const JsonNode& root) {
  MechanismFile result;
  result.canonical = root.value().dump(-1, ' ', false, Json::error_handler_t::replace);
  Draft draft;
  draft.bodies[kGround].name = "ground";
  draft.body_names.Add("ground");
  if (ExpectDocument(root, FileKind::kMechanism)) MechanismFileFields().ReadRows(root, &draft);
  result.observe = std::move(draft.observe);
  result.description = std::move(static_cast<MechanismDescription&>(draft));
  return result;
}

}  // namespace loopbench::harness
