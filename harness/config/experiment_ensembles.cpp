// "ensembles" of an experiment file.
#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <set>

#include "harness/config/experiment_reader.h"
#include "harness/config/experiment_sections.h"
#include "harness/json/spelling.h"

namespace loopbench::harness {
namespace {

// Farther coordinates [rad or m] start no member: its start is followed in steps of 0.1.
constexpr Range kFarthest = {.min = -1e4, .max = 1e4};
constexpr Range kAmplitude = {.min = 0.0, .max = kFarthest.max, .above_min = true};

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

/// {"joint": [from, to]}.
std::vector<DrawnCoordinate> ReadBetween(const JsonNode& node) {
  std::vector<DrawnCoordinate> drawn;
  for (const auto& [joint, bounds] : node.Members()) {
    const std::vector<double> ends = bounds.Numbers(2);
    const bool is_pair = bounds.value().is_array() && bounds.value().size() == 2;
    if (is_pair && !(ends[0] < ends[1])) bounds.Fail("two numbers that ascend [rad or m]");
    if (is_pair && !(kFarthest.Contains(ends[0]) && kFarthest.Contains(ends[1]))) {
      bounds.Fail(fmt::format("numbers{} [rad or m]", kFarthest.Text()));
    }
    drawn.push_back({joint, ends[0], ends[1]});
  }
  if (node.value().is_object() && node.value().empty()) node.Fail("at least one joint");
  return drawn;
}

/// Joints that can be drawn: held, with one coordinate.
NameList DrawableJoints(const MechanismDescription& description) {
  NameList names;
  for (const JointValues& values : description.initial.coordinates) {
    const std::vector<int>& held = description.initial.held;
    if (values.values.size() == 1 && std::ranges::find(held, values.joint) != held.end()) {
      names.Add(description.joints[static_cast<std::size_t>(values.joint)].name);
    }
  }
  return names;
}

/// Every scene of the rule's cases must have the joints to draw.
void CheckBetween(const JsonNode& element, const EnsembleRule& rule, const Experiment& experiment,
                  const std::vector<Case>& cases) {
  const auto node = element.Optional("between");
  if (!node) return;
  for (std::size_t s = 0; s < experiment.scenes.size(); ++s) {
    const bool used = std::ranges::any_of(
        cases, [&](const Case& one) { return one.scene == s && Matches(rule, one); });
    if (!used) continue;
    const NameList known = DrawableJoints(experiment.scenes[s].mechanism.description);
    for (const auto& [joint, bounds] : node->Members()) {
      if (known.Find(joint)) continue;
      bounds.FailAs(fmt::format("no held joint \"{}\" of one coordinate in scene \"{}\"", joint,
                                experiment.scenes[s].name),
                    fmt::format("a joint among: {}", fmt::join(known.all(), ", ")),
                    NearestSpelling(joint, known.all()));
    }
  }
}

EnsembleRule ReadEnsemble(const JsonNode& node, const Experiment& experiment) {
  EnsembleRule rule;
  if (!node.ExpectObject({"size", "seed", "perturb", "between", "branch_bound", "scenes",
                          "horizons", "tolerances", "formulation", "enforcement", "coordinates",
                          "solver"})) {
    return rule;
  }
  if (const auto size = node.Required("size", "an integer from 2")) {
    rule.size = static_cast<int>(size->Integer(2, kMaxCount));
  }
  if (const auto seed = node.Required("seed", "an integer from 0")) {
    constexpr std::int64_t kMaxSeed = std::numeric_limits<std::int32_t>::max();
    rule.seed = static_cast<std::uint64_t>(seed->Integer(0, kMaxSeed));
  }
  if (const auto between = node.Optional("between")) {
    if (const auto perturb = node.Optional("perturb"))
      perturb->Fail("no \"perturb\" with \"between\"");
    rule.between = ReadBetween(*between);
    rule.perturb = 0.0;
  } else if (const auto perturb = node.Required("perturb", "a number > 0, or \"between\"")) {
    rule.perturb = perturb->Number(kAmplitude);
  }
  if (const auto bound = node.Optional("branch_bound")) {
    rule.branch_bound = bound->Number(kPositive);
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
    CheckBetween(element, rule, *experiment, cases);
    experiment->ensembles.push_back(rule);
  }
}

}  // namespace loopbench::harness
