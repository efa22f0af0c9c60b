// "scenes" of an experiment file and the mechanisms they name.
#include <fmt/format.h>

#include <algorithm>
#include <set>
#include <system_error>

#include "harness/config/experiment_sections.h"
#include "harness/config/mechanism_reader.h"
#include "harness/config/mechanism_sections.h"
#include "harness/json/config_error.h"
#include "harness/json/spelling.h"
#include "mechanism/description/similarity.h"

namespace loopbench::harness {
namespace {

/// Names of the files beside a missing one, to suggest a spelling.
std::vector<std::string> FilesBeside(const std::filesystem::path& path) {
  std::vector<std::string> names;
  std::error_code error;
  const std::filesystem::path folder = path.has_parent_path() ? path.parent_path() : ".";
  for (const auto& entry : std::filesystem::directory_iterator(folder, error)) {
    names.push_back(entry.path().filename().string());
  }
  std::sort(names.begin(), names.end());
  return names;
}

/// A file of mechanisms as a scene names it; its own mistakes join those of the experiment.
void LoadMechanism(const JsonNode& node, MechanismFiles& files, ExperimentScene* scene) {
  const std::string named = node.Text();
  if (named.empty()) return;
  scene->path = files.Resolve(named);
  std::error_code error;
  const auto status = std::filesystem::status(scene->path, error);
  if (!std::filesystem::exists(status)) {
    const std::string nearest =
        NearestSpelling(scene->path.filename().string(), FilesBeside(scene->path));
    node.Fail(
        fmt::format("a mechanism file ({} does not exist)", scene->path.string()),
        nearest.empty() ? "" : (std::filesystem::path(named).parent_path() / nearest).string());
    return;
  }
  if (!std::filesystem::is_regular_file(status)) {
    node.Fail(fmt::format("a mechanism file ({} is none)", scene->path.string()));
    return;
  }
  try {
    scene->mechanism = files.Mechanism(scene->path);
  } catch (const ConfigError& mistakes) {
    node.errors().AddText(mistakes.what());
  }
}

/// The scene for each mechanism that "mechanism" stands for, without names.
std::vector<ExperimentScene> ReadMechanisms(const JsonNode& node, MechanismFiles& files,
                                            std::size_t room) {
  std::vector<ExperimentScene> scenes;
  if (node.value().is_object() && node.value().contains("family")) {
    for (FamilyMember& member : ReadFamilyMembers(node, room)) {
      ExperimentScene& scene = scenes.emplace_back();
      scene.name = std::move(member.counts);
      scene.mechanism = std::move(member.mechanism);
    }
    if (scenes.size() == 1) scenes.front().name.clear();
    return scenes;
  }
  ExperimentScene& scene = scenes.emplace_back();
  if (node.value().is_object()) {
    scene.mechanism = ReadMechanismObject(node);
  } else if (node.value().is_string()) {
    LoadMechanism(node, files, &scene);
  } else {
    node.Fail("the path of a mechanism file, a mechanism, or {\"family\": ...}");
  }
  return scenes;
}

/// The mechanism at another size; what is known of its angles still holds.
void Resize(MechanismFile* mechanism, double factor) {
  mechanism->description = AtScale(mechanism->description, factor);
  mechanism->observe.length *= factor;
  mechanism->canonical += fmt::format(" at scale {}", factor);
}

/// One entry of "scenes": several scenes where a family has several counts.
std::vector<ExperimentScene> ReadScene(const JsonNode& node, MechanismFiles& files,
                                       std::size_t room) {
  std::vector<ExperimentScene> scenes;
  if (!node.ExpectObject({"mechanism", "horizon", "name", "tags", "scale"})) return scenes;
  if (const auto mechanism = node.Required(
          "mechanism", "the path of a mechanism file, a mechanism, or {\"family\": ...}")) {
    scenes = ReadMechanisms(*mechanism, files, room);
  }
  ExperimentScene common;
  if (const auto horizon = node.Required("horizon", "a number > 0 or a list of them [s]")) {
    common.horizons = horizon->NumberList(kPositive);
  }
  if (const auto name = node.Optional("name")) common.name = name->Text();
  double scale = 1.0;
  if (const auto factor = node.Optional("scale"))
    scale = factor->Number({.min = 1e-12, .max = 1e12});
  if (const auto tags = node.Optional("tags")) {
    for (const JsonNode& tag : tags->Elements("tags")) common.tags.push_back(tag.Text());
  }
  for (ExperimentScene& scene : scenes) {
    // A mechanism that could not be read lends its file's name, so that references to it still
    // hold.
    const std::string own = scene.mechanism.description.name.empty()
                                ? scene.path.stem().string()
                                : scene.mechanism.description.name;
    const std::string counts = scene.name.empty() ? "" : "-" + scene.name;
    scene.name = common.name.empty() ? own : common.name + counts;
    if (scale > 0.0 && scale != 1.0) Resize(&scene.mechanism, scale);
    scene.horizons = common.horizons;
    scene.tags = common.tags;
  }
  return scenes;
}

/// Bodies other than ground.
std::size_t BodiesOf(const ExperimentScene& scene) {
  return scene.mechanism.description.bodies.size() - 1;
}

}  // namespace

const std::string& MechanismFiles::Text(const std::filesystem::path& path) {
  const auto known = texts_.find(path);
  return known != texts_.end() ? known->second
                               : texts_.emplace(path, ReadTextFile(path)).first->second;
}

Json MechanismFiles::Document(const std::filesystem::path& path) {
  return ParseDocument(Text(path), path.string());
}

const MechanismFile& MechanismFiles::Mechanism(const std::filesystem::path& path) {
  auto known = files_.find(path);
  if (known == files_.end()) {
    known = files_.emplace(path, File()).first;
    try {
      known->second.mechanism = ParseMechanism(Text(path), path.string());
    } catch (const ConfigError& mistakes) {
      known->second.mistakes = mistakes.what();
    }
  }
  if (!known->second.mistakes.empty()) throw ConfigError(known->second.mistakes);
  return known->second.mechanism;
}

std::vector<ExperimentScene> ReadScenes(const JsonNode& root, MechanismFiles& files,
                                        ErrorList* errors) {
  std::vector<ExperimentScene> scenes;
  std::set<std::string> names;
  std::size_t bodies = 0;
  const auto node = root.Required("scenes", "an array of scenes");
  if (!node) return scenes;
  const std::vector<JsonNode> elements = node->Elements("scenes");
  if (node->value().is_array() && elements.empty()) node->Fail("at least one scene");
  for (const JsonNode& element : elements) {
    const std::size_t room = kMaxBodies - std::min(kMaxBodies, bodies);
    for (ExperimentScene& scene : ReadScene(element, files, room)) {
      if (!scene.name.empty() && !names.insert(scene.name).second) {
        element.FailAs(fmt::format("scene \"{}\" again", scene.name), "a \"name\" of its own");
      }
      bodies += BodiesOf(scene);
      scenes.push_back(std::move(scene));
    }
    if (bodies > kMaxBodies) {
      errors->Add(element.pointer(), fmt::format("mechanisms with {} bodies so far", bodies),
                  fmt::format("at most {} in all scenes", kMaxBodies));
      break;
    }
  }
  return scenes;
}

}  // namespace loopbench::harness
