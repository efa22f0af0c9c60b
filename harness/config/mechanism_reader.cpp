#include "harness/config/mechanism_reader.h"

#include <fmt/format.h>

#include <utility>

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

std::string ReadNewName(const JsonNode& owner, const NameList& taken) {
  const auto node = owner.Required("name", "a name");
  if (!node) return "";
  std::string name = node->Text();
  if (taken.Find(name)) node->Fail("a name that is not in use yet");
  return name;
}

double ReadRequiredNumber(const JsonNode& owner, const std::string& key, const Range& range) {
  const auto node = owner.Required(key, "a number" + range.Text());
  return node ? node->Number(range) : 0.0;
}

double ReadOptionalNumber(const JsonNode& owner, const std::string& key, const Range& range,
                          double otherwise) {
  const auto node = owner.Optional(key);
  return node ? node->Number(range) : otherwise;
}

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
  if (ExpectDocument(root, FileKind::kMechanism)) {
    draft.name = ReadNewName(root, {});
    if (const auto comment = root.Optional("comment")) comment->Text();
    if (const auto space = root.Optional("space")) {
      const auto chosen = space->Choice({"planar", "spatial"}, "a space");
      if (chosen == 1) draft.space = SpaceKind::kSpatial;
    }
    if (const auto gravity = root.Required("gravity", "an array of 2 or 3 numbers [m/s^2]")) {
      draft.gravity = ReadVector(*gravity, draft.space);
    }
    ReadBodies(root, &draft);
    // without bodies everything that names one would be a mistake, and none of its own
    if (draft.bodies.size() > 1) {
      ReadJoints(root, &draft);
      ReadForces(root, &draft);
      ReadInitial(root, &draft);
      ReadIndependent(root, &draft);
      result.observe = ReadObservation(root, draft);
    }
  }
  result.description = std::move(static_cast<MechanismDescription&>(draft));
  return result;
}

}  // namespace loopbench::harness
