// "ensembles" of an experiment file.
#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <set>

#include "harness/config/experiment_reader.h"
#include "harness/config/experiment_sections.h"
#include "harness/text/spelling.h"

namespace loopbench::harness {
namespace {

// Farther coordinates [rad or m] start no member: its start is followed in steps of 0.1.
constexpr Range kFarthest = {.min = -1e4, .max = 1e4};
constexpr Range kAmplitude = {.min = 0.0, .max = kFarthest.max, .above_min = true};

/// A rule and what it selects from.
struct RuleOfExperiment : EnsembleRule {
  const Experiment* experiment = nullptr;
};

/// Each must be one of `used`: one that is not would match nothing.
std::vector<double> ReadUsedNumbers(const JsonNode& node, const std::vector<double>& used) {
  const std::vector<double> numbers = node.NumberList(kPositive);
  for (const double number : numbers) {
    if (std::find(used.begin(), used.end(), number) != used.end()) continue;
    constexpr std::size_t kMostShown = 16;
    const auto end = used.begin() + static_cast<int>(std::min(used.size(), kMostShown));
    if (used.empty()) {
      node.Fail("no such key: the experiment has none");
      break;
    }
    node.Fail(fmt::format("values among those of this experiment: {}{}",
                          fmt::join(used.begin(), end, ", "), end == used.end() ? "" : ", ..."));
    break;
  }
  return numbers;
}

void ReadTolerances(const JsonNode& node, RuleOfExperiment& rule) {
  rule.tolerances = ReadUsedNumbers(node, rule.experiment->tolerances);
}

void ReadHorizons(const JsonNode& node, RuleOfExperiment& rule) {
  std::set<double> horizons;
  for (const ExperimentScene& scene : rule.experiment->scenes) {
    horizons.insert(scene.horizons.begin(), scene.horizons.end());
  }
  rule.horizons = ReadUsedNumbers(node, {horizons.begin(), horizons.end()});
}

void ReadSceneNames(const JsonNode& node, RuleOfExperiment& rule) {
  NameList known;
  for (const ExperimentScene& scene : rule.experiment->scenes) known.Add(scene.name);
  for (const JsonNode& element : node.OneOrMore("scene names")) {
    const auto scene = element.Choice(known, "a scene");
    if (scene) rule.scenes.push_back(known.all()[static_cast<std::size_t>(*scene)]);
  }
}

/// {"joint": [from, to]}.
void ReadBetween(const JsonNode& node, EnsembleRule& rule) {
  for (const auto& [joint, bounds] : node.Members()) {
    const std::vector<double> ends = bounds.Numbers(2);
    const bool is_pair = bounds.value().is_array() && bounds.value().size() == 2;
    if (is_pair && !(ends[0] < ends[1])) bounds.Fail("two numbers that ascend [rad or m]");
    if (is_pair && !(kFarthest.Contains(ends[0]) && kFarthest.Contains(ends[1]))) {
      bounds.Fail(fmt::format("numbers{} [rad or m]", kFarthest.Text()));
    }
    rule.between.push_back({joint, ends[0], ends[1]});
  }
  if (node.value().is_object() && node.value().empty()) node.Fail("at least one joint");
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

/// One of the two ways to start anew.
void ReadStart(const JsonNode& node, RuleOfExperiment& rule) {
  if (const auto between = node.Optional("between")) {
    if (const auto perturb = node.Optional("perturb")) {
      perturb->Fail("no \"perturb\" with \"between\"");
    }
    ReadBetween(*between, rule);
    rule.perturb = 0.0;
  } else if (const auto perturb = node.Required("perturb", "a number > 0, or \"between\"")) {
    rule.perturb = perturb->Number(kAmplitude);
  }
}

const Fields<RuleOfExperiment>& EnsembleFields() {
  using Rule = RuleOfExperiment;
  constexpr std::int64_t kMaxSeed = std::numeric_limits<std::int32_t>::max();
  static const Json bounds = ArraySchema(NumberSchema(kFarthest), 2, 2);
  static const Json one_start = {{"oneOf", {Requires({"perturb"}), Requires({"between"})}}};
  static const Fields<Rule> fields(
      "ensemble",
      "Perturbed repetitions of the cases that match every given key of a case; the first rule "
      "that matches counts.",
      {{"size", Integer(&Rule::size, 2, kMaxCount), "Runs per case.", "an integer from 2"},
       {"seed", Integer(&Rule::seed, 0, kMaxSeed), "Of the generator of perturbations.",
        "an integer from 0"},
       {"perturb", NumberSchema(kAmplitude), "Amplitude on the held coordinates [rad or m]."},
       {"between", MapSchema(bounds, 1),
        "Instead of perturb: held joints, each drawn uniformly between two bounds [rad or m]."},
       {"", By(one_start, ReadStart)},
       {"branch_bound", Number(&Rule::branch_bound, kPositive),
        "A run further from its branch has left it [rad]."},
       {"scenes", By(OneOrMoreSchema(TextSchema()), ReadSceneNames), "Names of scenes."},
       {"horizons", By(NumberListSchema(kPositive), ReadHorizons), "Of cases [s]."},
       {"tolerances", By(NumberListSchema(kPositive), ReadTolerances), "Of cases."},
       {"formulation", FormulationChoices(&Rule::formulations), "Of cases."},
       {"enforcement", LevelChoices(&Rule::enforcements), "Of cases."},
       {"coordinates", Choices(&Rule::coordinates, NamesOf<Coordinates>(), "a coordinate set"),
        "Of cases."},
       {"solver", Choices(&Rule::solvers, NamesOf<SolverKind>(), "a solver"), "Of cases."}});
  return fields;
}

}  // namespace

Json EnsemblesSchema() { return ArraySchema(EnsembleFields().Schema(), 0, kMaxRules); }

void ReadEnsembles(const JsonNode& node, ExperimentFile& experiment) {
  const std::vector<JsonNode> elements = node.Elements("ensemble rules");
  if (elements.size() > kMaxRules) {
    node.Fail(fmt::format("at most {} ensemble rules", kMaxRules));
    return;
  }
  if (CountCases(experiment) > kMaxHeldCases) return;  // reported where it is counted
  const std::vector<Case> cases = Expand(experiment);
  for (const JsonNode& element : elements) {
    RuleOfExperiment rule;
    rule.experiment = &experiment;
    EnsembleFields().Read(element, &rule);
    const bool used = std::any_of(cases.begin(), cases.end(),
                                  [&rule](const Case& one) { return Matches(rule, one); });
    // Behind other mistakes this one would only be their consequence.
    if (!used && node.errors().empty()) {
      element.FailAs("a rule that matches no case", "keys that match at least one case");
    }
    CheckBetween(element, rule, experiment, cases);
    experiment.ensembles.push_back(rule);
  }
}

}  // namespace loopbench::harness
