// "reference" of an experiment file: what the motion itself is held against.
#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "harness/config/experiment_sections.h"
#include "harness/config/published_series.h"
#include "harness/text/config_error.h"

namespace loopbench::harness {
namespace {

constexpr std::array<const char*, 3> kOfCertified = {"scalar", "points", "cpu_s"};

/// The file that a node names, for one scene; its own mistakes join those of the experiment.
void ReadSeriesOf(const JsonNode& node, const MechanismFiles& files, ExperimentScene* scene) {
  const std::string named = node.Text();
  if (named.empty()) return;
  const std::filesystem::path path = files.Resolve(named);
  if (!ExpectFile(node, path, "a published series")) return;
  // the names of a mechanism that could not be read are not known
  const MechanismDescription& mechanism = scene->mechanism.description;
  try {
    scene->series = ReadPublishedSeries(path, mechanism.bodies.size() > 1 ? &mechanism : nullptr);
  } catch (const ConfigError& mistakes) {
    node.errors().AddText(mistakes.what());
  }
}

void ReadSeries(const JsonNode& node, ExperimentFile& experiment) {
  std::vector<ExperimentScene>& scenes = experiment.scenes;
  if (node.value().is_string()) {
    if (scenes.size() == 1) {
      ReadSeriesOf(node, *experiment.files, &scenes.front());
    } else if (scenes.size() > 1) {
      node.FailAs(fmt::format("one file for {} scenes", scenes.size()),
                  "an object with the file of each scene that has one, by the scene's name");
    }
    return;
  }
  if (!node.value().is_object()) {
    node.Fail("the path of a published series, or an object with one for each scene by its name");
    return;
  }
  NameList names;
  for (const ExperimentScene& scene : scenes) names.Add(scene.name);
  if (!node.ExpectObject(names)) return;
  if (node.value().empty()) node.Fail("at least one scene with its file");
  for (ExperimentScene& scene : scenes) {
    if (const auto file = node.Optional(scene.name)) {
      ReadSeriesOf(*file, *experiment.files, &scene);
    }
  }
}

void RequireSeriesAlone(const JsonNode& node, ReferenceOptions&) {
  if (!node.Optional("series")) return;
  for (const char* key : kOfCertified) {
    if (!node.Optional(key)) continue;
    node.FailAs(fmt::format("\"series\" beside \"{}\"", key),
                "one of them: what was published is not made");
  }
}

Json SeriesAloneSchema() {
  Json others = Json::array();
  for (const char* key : kOfCertified) others.push_back(Requires({key}));
  return {{"if", {{"required", {"series"}}}}, {"then", {{"not", {{"anyOf", others}}}}}};
}

}  // namespace

const Fields<ReferenceOptions>& ReferenceFields() {
  static const NameList scalars({"as-needed", "long-double", "float128"});
  static const Fields<ReferenceOptions> fields(
      "reference",
      "Each mechanism and horizon once more at high order in a wide scalar, by two formulations "
      "and at two tolerances: where these agree, runs are held against them. Kept beside the "
      "store. Or numbers that others published.",
      {{"scalar", Choice(&ReferenceOptions::scalar, scalars, "a wide scalar"),
        "float128 has 33 digits, takes some 50 times as long, and is for planar mechanisms; as "
        "needed it follows where long-double does not certify to the end."},
       {"points", Integer(&ReferenceOptions::points, 2, kMostPoints),
        "Times at which errors are taken, evenly from the start to the end."},
       {"cpu_s", Number(&ReferenceOptions::cpu_s, kPositive),
        "CPU time of each integration [s]. One that is cut off certifies as far as it got."},
       {"series", EitherSchema({TextSchema(), MapSchema(TextSchema(), 1)}),
        "Instead: path of a published series (series.schema.json), relative to this file; with "
        "several scenes an object of such paths by the scenes' names. Scenes without one have no "
        "reference."},
       {"", By(SeriesAloneSchema(), RequireSeriesAlone)}});
  return fields;
}

void ReadReferenceOptions(const JsonNode& node, ExperimentFile& experiment) {
  ReferenceFields().Read(node, &experiment.reference.emplace());
  const auto series = node.Optional("series");
  if (!series) return;
  experiment.reference.reset();
  ReadSeries(*series, experiment);
}

}  // namespace loopbench::harness
