// "scenes" of an experiment file and the mechanisms they name.
#include <fmt/format.h>

#include <algorithm>
#include <set>
#include <system_error>

#include "harness/config/experiment_sections.h"
#include "harness/config/mechanism_reader.h"
#include "harness/config/mechanism_sections.h"
#include "harness/text/config_error.h"
#include "harness/text/spelling.h"
#include "mechanism/description/similarity.h"

namespace loopbench::harness {
namespace {

/// A file of mechanisms as a scene names it; its own mistakes join those of the experiment.
void LoadMechanism(const JsonNode& node, MechanismFiles& files, ExperimentScene* scene) {
  const std::string named = node.Text();
  if (named.empty()) return;
  scene->path = files.Resolve(named);
  if (!ExpectFile(node, scene->path, "a mechanism file")) return;
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

/// One entry of "scenes": several scenes where a family has several counts. The base is what they
/// have in common.
struct SceneEntry : ExperimentScene {
  MechanismFiles* files = nullptr;
  std::size_t room = 0;  ///< bodies there may be
  double scale = 1.0;
  std::vector<ExperimentScene> scenes;
};

void ReadMechanism(const JsonNode& node, SceneEntry& entry) {
  entry.scenes = ReadMechanisms(node, *entry.files, entry.room);
}

void ReadTags(const JsonNode& node, SceneEntry& entry) {
  for (const JsonNode& tag : node.Elements("tags")) entry.tags.push_back(tag.Text());
}

const Fields<SceneEntry>& SceneFields() {
  static const Json mechanism =
      EitherSchema({TextSchema(),
                    FamilySchema(),
                    {{"$ref", "mechanism.schema.json#"}, {"words", "a [mechanism](#mechanism)"}}});
  static const Fields<SceneEntry> fields(
      "scene", "A mechanism and how long it moves.",
      {{"mechanism", By(mechanism, ReadMechanism),
        "Path of a mechanism file, relative to this file; a member of a family, one scene per "
        "count; or a mechanism (mechanism.schema.json).",
        "the path of a mechanism file, a mechanism, or {\"family\": ...}"},
       {"horizon", NumberList(&SceneEntry::horizons, kPositive), "Simulated time [s].",
        "a number > 0 or a list of them [s]"},
       {"name", Text(&SceneEntry::name), "Instead of the mechanism's own name."},
       {"tags", By(ArraySchema(TextSchema()), ReadTags), "Words for filters and tables."},
       {"scale", Number(&SceneEntry::scale, {.min = 1e-12, .max = 1e12}),
        "Factor on all lengths; gravity, forces and springs go with it so that angles move as "
        "before."}});
  return fields;
}

std::vector<ExperimentScene> ReadScene(const JsonNode& node, MechanismFiles& files,
                                       std::size_t room) {
  SceneEntry entry;
  entry.files = &files;
  entry.room = room;
  SceneFields().Read(node, &entry);
  for (ExperimentScene& scene : entry.scenes) {
    // A mechanism that could not be read lends its file's name, so that references to it still
    // hold.
    const std::string own = scene.mechanism.description.name.empty()
                                ? scene.path.stem().string()
                                : scene.mechanism.description.name;
    const std::string counts = scene.name.empty() ? "" : "-" + scene.name;
    scene.name = entry.name.empty() ? own : entry.name + counts;
    if (entry.scale > 0.0 && entry.scale != 1.0) Resize(&scene.mechanism, entry.scale);
    scene.horizons = entry.horizons;
    scene.tags = entry.tags;
  }
  return std::move(entry.scenes);
}

/// Bodies other than ground.
std::size_t BodiesOf(const ExperimentScene& scene) {
  return scene.mechanism.description.bodies.size() - 1;
}

void ReadScenes(const JsonNode& node, ExperimentFile& experiment) {
  std::set<std::string> names;
  std::size_t bodies = 0;
  const std::vector<JsonNode> elements = node.Elements("scenes");
  if (node.value().is_array() && elements.empty()) node.Fail("at least one scene");
  for (const JsonNode& element : elements) {
    const std::size_t room = kMaxBodies - std::min(kMaxBodies, bodies);
    for (ExperimentScene& scene : ReadScene(element, *experiment.files, room)) {
      if (!scene.name.empty() && !names.insert(scene.name).second) {
        element.FailAs(fmt::format("scene \"{}\" again", scene.name), "a \"name\" of its own");
      }
      bodies += BodiesOf(scene);
      experiment.scenes.push_back(std::move(scene));
    }
    if (bodies > kMaxBodies) {
      element.FailAs(fmt::format("mechanisms with {} bodies so far", bodies),
                     fmt::format("at most {} in all scenes", kMaxBodies));
      break;
    }
  }
}

}  // namespace

bool ExpectFile(const JsonNode& node, const std::filesystem::path& path, std::string_view what) {
  std::error_code error;
  if (std::filesystem::is_regular_file(path, error)) return true;
  if (std::filesystem::exists(path, error)) {
    node.Fail(fmt::format("{} ({} is none)", what, path.string()));
    return false;
  }
  std::vector<std::string> beside;
  const std::filesystem::path folder = path.has_parent_path() ? path.parent_path() : ".";
  for (const auto& entry : std::filesystem::directory_iterator(folder, error)) {
    beside.push_back(entry.path().filename().string());
  }
  std::ranges::sort(beside);
  const std::string nearest = NearestSpelling(path.filename().string(), beside);
  const std::filesystem::path named = node.Text();
  node.Fail(fmt::format("{} ({} does not exist)", what, path.string()),
            nearest.empty() ? "" : (named.parent_path() / nearest).string());
  return false;
}

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

FieldValue<ExperimentFile> ScenesValue() {
  return By(ArraySchema(SceneFields().Schema(), 1), ReadScenes);
}

}  // namespace loopbench::harness
