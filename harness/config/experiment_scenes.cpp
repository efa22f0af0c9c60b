// "scenes" of an experiment file and the mechanisms they name.
#include <fmt/format.h>

#include <system_error>

#include "harness/config/config_error.h"
#include "harness/config/experiment_sections.h"
#include "harness/config/mechanism_reader.h"
#include "harness/config/spelling.h"

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

/// Loads the mechanism of a scene; its own mistakes join those of the experiment.
void LoadMechanism(const JsonNode& node, const std::filesystem::path& folder,
                   ExperimentScene* scene, ErrorList* errors) {
  const std::string named = node.Text();
  if (named.empty()) return;
  scene->path = (folder / named).lexically_normal();
  std::error_code error;
  if (!std::filesystem::exists(scene->path, error)) {
    const std::string nearest =
        NearestSpelling(scene->path.filename().string(), FilesBeside(scene->path));
    node.Fail(
        fmt::format("a mechanism file ({} does not exist)", scene->path.string()),
        nearest.empty() ? "" : (std::filesystem::path(named).parent_path() / nearest).string());
    return;
  }
  try {
    scene->mechanism = ReadMechanism(scene->path);
  } catch (const ConfigError& mistakes) {
    errors->AddText(mistakes.what());
  }
}

ExperimentScene ReadScene(const JsonNode& node, const std::filesystem::path& folder,
                          ErrorList* errors) {
  ExperimentScene scene;
  if (!node.ExpectObject({"mechanism", "horizon", "name", "tags"})) return scene;
  if (const auto mechanism = node.Required("mechanism", "the path of a mechanism file")) {
    LoadMechanism(*mechanism, folder, &scene, errors);
  }
  if (const auto horizon = node.Required("horizon", "a number > 0 or a list of them [s]")) {
    scene.horizons = horizon->NumberList(kPositive);
  }
  // A mechanism that could not be read lends its file's name, so that references to it still hold.
  scene.name = scene.mechanism.description.name.empty() ? scene.path.stem().string()
                                                        : scene.mechanism.description.name;
  if (const auto name = node.Optional("name")) scene.name = name->Text();
  if (const auto tags = node.Optional("tags")) {
    for (const JsonNode& tag : tags->Elements("tags")) scene.tags.push_back(tag.Text());
  }
  return scene;
}

}  // namespace

std::vector<ExperimentScene> ReadScenes(const JsonNode& root, const std::filesystem::path& folder,
                                        ErrorList* errors) {
  std::vector<ExperimentScene> scenes;
  const auto node = root.Required("scenes", "an array of scenes");
  if (!node) return scenes;
  const std::vector<JsonNode> elements = node->Elements("scenes");
  if (node->value().is_array() && elements.empty()) node->Fail("at least one scene");
  for (const JsonNode& element : elements) {
    ExperimentScene scene = ReadScene(element, folder, errors);
    const bool again =
        std::any_of(scenes.begin(), scenes.end(), [&scene](const ExperimentScene& other) {
          return !scene.name.empty() && other.name == scene.name;
        });
    if (again) {
      element.FailAs(fmt::format("scene \"{}\" again", scene.name), "a \"name\" of its own");
    }
    scenes.push_back(std::move(scene));
  }
  return scenes;
}

}  // namespace loopbench::harness
