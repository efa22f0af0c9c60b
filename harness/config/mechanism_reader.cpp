#include "harness/config/mechanism_reader.h"

#include <fmt/format.h>

#include <algorithm>

#include "harness/config/mechanism_sections.h"

namespace loopbench::harness {

Eigen::Vector3d ReadVector(const JsonNode& node, SpaceKind space) {
  const Eigen::Vector3d vector = node.Vector();
  if (space == SpaceKind::kPlanar && vector.z() != 0.0) node.Fail("z = 0 in a planar mechanism");
  return vector;
}

Eigen::Vector3d ReadPoint(const JsonNode& node, const BodyDescription& body, SpaceKind space) {
  if (node.value().is_array()) return ReadVector(node, space);
  std::vector<std::string> names;
  for (const auto& [name, position] : body.points) names.push_back(name);
  const auto point = node.Choice(names, fmt::format("coordinates or a point of \"{}\"", body.name));
  return point ? body.points.at(names[static_cast<std::size_t>(*point)]) : Eigen::Vector3d::Zero();
}

std::optional<int> ReadBodyName(const JsonNode& node, const MechanismDescription& description) {
  return node.Choice(BodyNames(description), "a body");
}

std::optional<int> ReadJointName(const JsonNode& node, const MechanismDescription& description) {
  return node.Choice(JointNames(description), "a joint");
}

std::string ReadNewName(const JsonNode& owner, const std::vector<std::string>& taken) {
  const auto node = owner.Required("name", "a name");
  if (!node) return "";
  std::string name = node->Text();
  const bool again = std::find(taken.begin(), taken.end(), name) != taken.end();
  if (again && !name.empty()) node->Fail("a name that is not in use yet");
  return name;
}

std::vector<std::string> BodyNames(const MechanismDescription& description) {
  std::vector<std::string> names;
  for (const BodyDescription& body : description.bodies) names.push_back(body.name);
  return names;
}

std::vector<std::string> JointNames(const MechanismDescription& description) {
  std::vector<std::string> names;
  for (const JointDescription& joint : description.joints) names.push_back(joint.name);
  return names;
}

MechanismFile ReadMechanism(const std::filesystem::path& path) {
  return ParseMechanism(ReadTextFile(path), path.string());
}

MechanismFile ParseMechanism(std::string_view text, const std::string& file) {
  const Json document = ParseDocument(text, file);
  ErrorList errors(file);
  const JsonNode root(document, "", errors);
  MechanismFile result;
  result.canonical = document.dump();
  MechanismDescription& description = result.description;
  if (root.ExpectObject({"name", "comment", "space", "gravity", "bodies", "ground", "joints",
                         "forces", "initial", "independent", "observe"})) {
    description.name = ReadNewName(root, {});
    if (const auto comment = root.Optional("comment")) comment->Text();
    if (const auto space = root.Optional("space")) {
      const auto chosen = space->Choice({"planar", "spatial"}, "a space");
      if (chosen == 1) description.space = SpaceKind::kSpatial;
    }
    if (const auto gravity = root.Required("gravity", "an array of 2 or 3 numbers [m/s^2]")) {
      description.gravity = ReadVector(*gravity, description.space);
    }
    ReadBodies(root, &description);
    ReadJoints(root, &description);
    ReadForces(root, &description);
    ReadInitial(root, &description);
    ReadIndependent(root, &description);
    result.observe = ReadObservation(root, description);
  }
  errors.ThrowIfAny();
  return result;
}

}  // namespace loopbench::harness
