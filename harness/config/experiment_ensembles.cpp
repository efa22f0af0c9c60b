// "ensembles" of an experiment file.
#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <set>

#include "harness/config/experiment_reader.h"
#include "harness/config/experiment_sections.h"

namespace loopbench::harness {
namespace {

/// Numbers of a rule, each one of `used`: one that is not would match nothing.
std::vector<double> ReadUsedNumbers(const JsonNode& rule, const std::string& key,
                                    const std::vector<double>& used) {
  const auto node = rule.Optional(key);
  if (!node) return {};
  const std::vector<double> numbers = node->NumberList(kPositive);
  for (const double number : numbers) {
    if (std::find(used.begin(), used.end(), number) != used.end()) continue;
    constexpr std::size_t kMostShown = 16;
    const auto end = used.begin() + static_cast<int>(std::min(used.size(), kMostShown));
    node->Fail(fmt::format("values among those of this experiment: {}{}",
                           fmt::join(used.begin(), end, ", "), end == used.end() ? "" : ", ..."));
    break;
  }
  return numbers;
}

std::vector<double> AllHorizons(const Experiment& experiment) {
  std::set<double> horizons;
  for (const ExperimentScene& scene : experiment.scenes) {
    horizons.insert(scene.horizons.begin(), scene.horizons.end());
  }
  return {horizons.begin(), horizons.end()};
}

std::vector<std::string> ReadSceneNames(const JsonNode& rule, const Experiment& experiment) {
  std::vector<std::string> chosen;
  NameList known;
  for (const ExperimentScene& scene : experiment.scenes) known.Add(scene.name);
  const auto node = rule.Optional("scenes");
  if (!node) return chosen;
  for (const JsonNode& element : node->OneOrMore("scene names")) {
    const auto scene = element.Choice(known, "a scene");
    if (scene) chosen.push_back(known.all()[static_cast<std::size_t>(*scene)]);
  }
  return chosen;
}

EnsembleRule ReadEnsemble(const JsonNode& node, const Experiment& experiment) {
  EnsembleRule rule;
  if (!node.ExpectObject({"size", "seed", "perturb", "scenes", "horizons", "tolerances",
                          "formulation", "enforcement", "coordinates", "solver"})) {
    return rule;
  }
  if (const auto size = node.Required("size", "an integer from 2")) {
    rule.size = static_cast<int>(size->Integer(2, kMaxCount));
  }
  if (const auto seed = node.Required("seed", "an integer from 0")) {
    constexpr std::int64_t kMaxSeed = std::numeric_limits<std::int32_t>::max();
    rule.seed = static_cast<std::uint64_t>(seed->Integer(0, kMaxSeed));
  }
  if (const auto perturb = node.Required("perturb", "a number > 0")) {
    rule.perturb = perturb->Number(kPositive);
  }
  rule.scenes = ReadSceneNames(node, experiment);
  rule.horizons = ReadUsedNumbers(node, "horizons", AllHorizons(experiment));
  rule.tolerances = ReadUsedNumbers(node, "tolerances", experiment.tolerances);
  rule.formulations = ReadEnums<FormulationKind>(node, "formulation", "a formulation", {});
  rule.enforcements = ReadEnums<Enforcement>(node, "enforcement", "a level of enforcement", {});
  rule.coordinates = ReadEnums<Coordinates>(node, "coordinates", "a coordinate set", {});
  rule.solvers = ReadEnums<SolverKind>(node, "solver", "a solver", {});
  return rule;
}

}  // namespace

void ReadEnsembles(const JsonNode& root, const ErrorList& errors, Experiment* experiment) {
  const auto node = root.Optional("ensembles");
  if (!node) return;
  const std::vector<JsonNode> elements = node->Elements("ensemble rules");
  if (elements.size() > kMaxRules) {
    node->Fail(fmt::format("at most {} ensemble rules", kMaxRules));
    return;
  }
  if (CountCases(*experiment) > kMaxCases) return;  // reported where it is counted
  const std::vector<Case> cases = Expand(*experiment);
  for (const JsonNode& element : elements) {
    const EnsembleRule rule = ReadEnsemble(element, *experiment);
    const bool used = std::any_of(cases.begin(), cases.end(),
                                  [&rule](const Case& one) { return Matches(rule, one); });
    // Behind other mistakes this one would only be their consequence.
    if (!used && errors.empty()) {
      element.FailAs("a rule that matches no case", "keys that match at least one case");
    }
    experiment->ensembles.push_back(rule);
  }
}

}  // namespace loopbench::harness
