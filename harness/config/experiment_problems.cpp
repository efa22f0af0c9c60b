// Sections of an experiment: problems, families of mechanisms, ensembles of initial values.

#include <numbers>
#include <set>

#include "harness/base/text.h"
#include "harness/config/experiment_reader.h"
#include "harness/config/experiment_sections.h"
#include "harness/config/mechanism_sections.h"
#include "mechanism/description/library.h"
#include "mechanism/description/transforms.h"

namespace loopbench::harness {
namespace {

// Limits of drawn coordinates [rad or m]: a member's start is reached in steps of 0.1.
constexpr Range kFarthest = {.min = -1e4, .max = 1e4};
constexpr Range kAmplitude = {.min = 0.0, .max = kFarthest.max, .above_min = true};

/// Reads numbers that must be in `used`; others would match nothing.
std::vector<double> ReadUsedNumbers(const JsonNode& node, const std::vector<double>& used) {
  const std::vector<double> numbers = node.NumberList(kPositive);
  for (const double number : numbers) {
    if (std::find(used.begin(), used.end(), number) != used.end()) continue;
    constexpr std::size_t kMaxShown = 16;
    const auto end = used.begin() + static_cast<int>(std::min(used.size(), kMaxShown));
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

void ReadTolerances(const JsonNode& node, EnsembleRule& rule, const Experiment& experiment) {
  rule.tolerances = ReadUsedNumbers(node, experiment.tolerances);
}

void ReadHorizons(const JsonNode& node, EnsembleRule& rule, const Experiment& experiment) {
  std::set<double> horizons;
  for (const ExperimentProblem& problem : experiment.problems) {
    horizons.insert(problem.horizons.begin(), problem.horizons.end());
  }
  rule.horizons = ReadUsedNumbers(node, {horizons.begin(), horizons.end()});
}

void ReadProblemNames(const JsonNode& node, EnsembleRule& rule, const Experiment& experiment) {
  NameList known;
  for (const ExperimentProblem& problem : experiment.problems) known.Add(problem.name);
  for (const JsonNode& element : node.OneOrMore("problem names")) {
    const auto problem = element.Choice(known, "a problem");
    if (problem) rule.problems.push_back(known.all()[static_cast<std::size_t>(*problem)]);
  }
}

/// Reads {"joint": [from, to]}.
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

/// Returns joints that can be drawn: fixed, with one coordinate.
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

/// Checks that every problem of the rule's cases has the joints to draw.
void CheckBetween(const JsonNode& element, const EnsembleRule& rule, const Experiment& experiment,
                  const std::vector<Case>& cases) {
  const auto node = element.Optional("between");
  if (!node) return;
  for (std::size_t s = 0; s < experiment.problems.size(); ++s) {
    const bool used = std::ranges::any_of(
        cases, [&](const Case& one) { return one.problem == s && Matches(rule, one); });
    if (!used) continue;
    const NameList known = DrawableJoints(experiment.problems[s].mechanism.description);
    for (const auto& [joint, bounds] : node->Members()) {
      if (known.Find(joint)) continue;
      bounds.FailAs(fmt::format("no held joint \"{}\" of one coordinate in problem \"{}\"", joint,
                                experiment.problems[s].name),
                    fmt::format("a joint among: {}", fmt::join(known.all(), ", ")),
                    NearestSpelling(joint, known.all()));
    }
  }
}

/// Reads "between" or "perturb".
void ReadStart(const JsonNode& node, EnsembleRule& rule) {
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

const Fields<EnsembleRule, const Experiment>& EnsembleFields() {
  using Rule = EnsembleRule;
  constexpr std::int64_t kMaxSeed = std::numeric_limits<std::int32_t>::max();
  static const Json bounds = ArraySchema(NumberSchema(kFarthest), 2, 2);
  static const Json one_start = {{"oneOf", {Requires({"perturb"}), Requires({"between"})}}};
  static const Fields<Rule, const Experiment> fields(
      "ensemble",
      "Perturbed repetitions of the cases that match all given case keys. The first match "
      "applies.",
      {{"size", Integer(&Rule::size, 2, kMaxCount), "Runs per case.", "an integer from 2"},
       {"seed", Integer(&Rule::seed, 0, kMaxSeed), "Seed of the random perturbations.",
        "an integer from 0"},
       {"perturb", NumberSchema(kAmplitude), "Perturbation amplitude of fixed joints [rad or m]."},
       {"between", MapSchema(bounds, 1),
        "Instead of perturb: fixed joints, each drawn uniformly between two bounds [rad or m]."},
       {"", By(one_start, ReadStart)},
       {"branch_bound", Number(&Rule::branch_bound, kPositive),
        "Branch error beyond which a run has left its branch [rad]."},
       {"problems", By(OneOrMoreSchema(TextSchema()), ReadProblemNames), "Names of problems."},
       {"horizons", By(NumberListSchema(kPositive), ReadHorizons), "Horizons of cases [s]."},
       {"tolerances", By(NumberListSchema(kPositive), ReadTolerances), "Tolerances of cases."},
       {"formulation", Choices(&Rule::formulations, FormulationNames, "a formulation"),
        "Formulations of cases."},
       {"enforcement", Choices(&Rule::enforcements, LevelNames, "a level of enforcement"),
        "Enforcement levels of cases."},
       {"coordinates", Choices(&Rule::coordinates, NamesOf<Coordinates>, "a coordinate set"),
        "Coordinates of cases."},
       {"solver", Choices(&Rule::solvers, NamesOf<SolverKind>, "a solver"), "Solvers."}});
  return fields;
}

void ReadEnsembles(const JsonNode& node, ExperimentFile& experiment) {
  const std::vector<JsonNode> elements = node.Elements("ensemble rules");
  if (elements.size() > kMaxRules) {
    node.Fail(fmt::format("at most {} ensemble rules", kMaxRules));
    return;
  }
  if (CountCases(experiment) > kMaxHeldCases) return;  // reported by the count
  const std::vector<Case> cases = Expand(experiment);
  for (const JsonNode& element : elements) {
    EnsembleRule rule;
    EnsembleFields().Read(element, &rule, experiment);
    const bool used = std::any_of(cases.begin(), cases.end(),
                                  [&rule](const Case& one) { return Matches(rule, one); });
    // After other errors, this error may be a consequence.
    if (!used && node.errors().empty()) {
      element.FailAs("a rule that matches no case", "keys that match at least one case");
    }
    CheckBetween(element, rule, experiment, cases);
    experiment.ensembles.push_back(rule);
  }
}

// Families of mechanisms (library.h) as problems: {"family": "chain", "bars": 10}.

constexpr std::int64_t kMaxUnits = 100'000;  ///< bars, windows, storeys

/// `sizes` are bars or windows. Defaults of cranks are as in timing.
struct Family {
  std::vector<std::int64_t> sizes, storeys;
  double angle = 1.0, speed = 1.0;
};
struct ChainFamily : Family {
  ChainFamily() { speed = 0.0; }
};

std::string CountsExpected(int least) {
  return fmt::format("an integer from {}, a list of them or a range", least);
}

const Fields<ChainFamily>& ChainFields() {
  static const Fields<ChainFamily> fields(
      "chain", "Closed chain of bars.",
      {{"family", ChoiceSchema({"chain"}), "Family type.", "a family"},
       {"bars", IntegerList(&Family::sizes, 3, kMaxUnits), "Number of bars.", CountsExpected(3)},
       {"speed", Number(&Family::speed), "Speed of the first bar [rad/s]."}});
  return fields;
}

const Fields<Family>& LadderFields() {
  static const Fields<Family> fields(
      "ladder", "Windows in a row: parallel cranks with couplers between them.",
      {{"family", ChoiceSchema({"ladder"}), "Family type.", "a family"},
       {"windows", IntegerList(&Family::sizes, 1, kMaxUnits), "Number of windows.",
        CountsExpected(1)},
       {"angle", Number(&Family::angle), "Angle of the cranks [rad]."},
       {"speed", Number(&Family::speed), "Speed of the cranks [rad/s]."}});
  return fields;
}

const Fields<Family>& GridFields() {
  static const Fields<Family> fields(
      "grid", "Storeys of windows.",
      {{"family", ChoiceSchema({"grid"}), "Family type.", "a family"},
       {"storeys", IntegerList(&Family::storeys, 1, kMaxUnits), "Number of storeys.",
        CountsExpected(1)},
       {"windows", IntegerList(&Family::sizes, 1, kMaxUnits), "Windows in each storey.",
        CountsExpected(1)},
       {"angle", Number(&Family::angle),
        "Angle of the first storey's cranks [rad]. It increases by 0.1 per storey."},
       {"speed", Number(&Family::speed),
        "Speed of the first storey's cranks [rad/s]. Storey r has r times this speed."}});
  return fields;
}

/// Fixes joints for perturbation by ensembles: as many as degrees of freedom.
void HoldNamed(MechanismDescription* description, std::string_view start, std::string_view end,
               std::size_t count) {
  for (std::size_t i = 0; i < description->joints.size(); ++i) {
    if (description->initial.held.size() == count) return;
    const std::string& name = description->joints[i].name;
    if (name.starts_with(start) && name.ends_with(end)) {
      description->initial.held.push_back(static_cast<int>(i));
    }
  }
}

/// The cranks turn as one pendulum: n + 1 cranks and n couplers, which only shift, all of 1 m and
/// 1 kg, give [(n + 1) / 3 + n] phi'' = -[(n + 1) / 2 + n] g sin(phi).
PendulumForm PendulumOfLadder(const MechanismDescription& ladder) {
  const double n = static_cast<double>(ladder.bodies.size() - 2) / 2;  // without Ground
  return {.body = "crank0",
          .down_angle = -std::numbers::pi / 2,
          .frequency_squared = ((n + 1) / 2 + n) * -ladder.gravity.y() / ((n + 1) / 3 + n)};
}

MechanismFile MakeChain(const Family& family, int bars, int) {
  MechanismFile made{Chain(bars), {}, {}};
  if (family.speed != 0.0) made.description.initial.speeds.push_back({0, {family.speed}});
  HoldNamed(&made.description, "J", "", static_cast<std::size_t>(bars) - 2);
  return made;
}

MechanismFile MakeLadder(const Family& family, int windows, int) {
  MechanismFile made{Ladder(windows, family.angle, family.speed), {}, {}};
  HoldNamed(&made.description, "O", "", 1);
  made.observe.closed_form = PendulumOfLadder(made.description);
  return made;
}

MechanismFile MakeGrid(const Family& family, int windows, int storeys) {
  MechanismFile made{Grid(storeys, windows, family.angle, family.speed), {}, {}};
  // the first crank of each storey, an independent coordinate: Jcrank1.0, Jcrank2.0, ...
  HoldNamed(&made.description, "Jcrank", ".0", static_cast<std::size_t>(storeys));
  return made;
}

Json FamilySchema() {
  return Named("family", EitherSchema({ChainFields().Schema(), LadderFields().Schema(),
                                       GridFields().Schema()}));
}

/// Returns all members, named by their counts: "10", "3x4". `room`: maximum number of bodies.
std::vector<ExperimentProblem> ReadFamilyMembers(const JsonNode& node, std::size_t room) {
  static const NameList kNames = {"chain", "ladder", "grid"};
  constexpr auto kMake = std::array{MakeChain, MakeLadder, MakeGrid};
  const auto name = node.Required("family", "a family");
  const auto kind = name ? name->Choice(kNames, "a family") : std::nullopt;
  if (!kind) return {};
  const bool is_chain = *kind == 0, is_grid = *kind == 2;
  Family family;
  if (is_chain) {
    ChainFamily chain;
    ChainFields().Read(node, &chain);
    family = chain;
  } else {
    (is_grid ? GridFields() : LadderFields()).Read(node, &family);
  }
  if (!is_grid) family.storeys = {1};
  std::vector<ExperimentProblem> members;
  std::size_t bodies = 0;
  for (const std::int64_t storeys : family.storeys) {
    for (const std::int64_t size : family.sizes) {
      bodies += static_cast<std::size_t>(is_chain ? size : storeys * (2 * size + 1));
      if (bodies > room) continue;  // before a large member is built
      ExperimentProblem& member = members.emplace_back();
      member.name = is_grid ? fmt::format("{}x{}", storeys, size) : fmt::format("{}", size);
      member.mechanism = kMake[static_cast<std::size_t>(*kind)](family, static_cast<int>(size),
                                                                static_cast<int>(storeys));
      Json canonical = {{"family", kNames.all()[static_cast<std::size_t>(*kind)]}};
      if (is_grid) canonical["storeys"] = storeys;
      canonical[is_chain ? "bars" : "windows"] = size;
      if (!is_chain) canonical["angle"] = family.angle;
      canonical["speed"] = family.speed;
      member.mechanism.canonical = canonical.dump();
    }
  }
  if (bodies > room) {
    node.FailAs(fmt::format("mechanisms with {} bodies", bodies),
                fmt::format("at most {} in all problems", kMaxBodies));
  }
  return members;
}

/// Reads the mechanism file of a problem; its errors are added to the experiment's errors.
void LoadMechanism(const JsonNode& node, MechanismFiles& files, ExperimentProblem* problem) {
  const std::string named = node.Text();
  if (named.empty()) return;
  problem->path = files.Resolve(named);
  ReadNamedFile(node, problem->path, "a mechanism file",
                [&] { problem->mechanism = files.Mechanism(problem->path); });
}

/// Returns a problem without name for each mechanism of "mechanism".
std::vector<ExperimentProblem> ReadMechanisms(const JsonNode& node, MechanismFiles& files,
                                              std::size_t room) {
  if (node.value().is_object() && node.value().contains("family")) {
    std::vector<ExperimentProblem> members = ReadFamilyMembers(node, room);
    if (members.size() == 1) members.front().name.clear();
    return members;
  }
  std::vector<ExperimentProblem> problems(1);
  ExperimentProblem& problem = problems.front();
  if (node.value().is_object()) {
    problem.mechanism = ReadMechanismObject(node);
  } else if (node.value().is_string()) {
    LoadMechanism(node, files, &problem);
  } else {
    node.Fail("the path of a mechanism file, a mechanism, or {\"family\": ...}");
  }
  return problems;
}

/// Scales the mechanism; known properties of angles stay valid.
void Resize(MechanismFile* mechanism, double factor) {
  mechanism->description = AtScale(mechanism->description, factor);
  mechanism->observe.length *= factor;
  mechanism->canonical += fmt::format(" at scale {}", factor);
}

/// Entry of "problems": its common values, and several problems for several counts of a family.
struct ProblemEntry : ExperimentProblem {
  MechanismFiles* files = nullptr;
  std::size_t room = 0;  ///< maximum number of bodies
  double scale = 1.0;
  std::vector<ExperimentProblem> problems;
};

void ReadMechanism(const JsonNode& node, ProblemEntry& entry) {
  entry.problems = ReadMechanisms(node, *entry.files, entry.room);
}

void ReadTags(const JsonNode& node, ProblemEntry& entry) {
  for (const JsonNode& tag : node.Elements("tags")) entry.tags.push_back(tag.Text());
}

const Fields<ProblemEntry>& ProblemFields() {
  static const Json mechanism =
      EitherSchema({TextSchema(),
                    FamilySchema(),
                    {{"$ref", "mechanism.schema.json#"}, {"words", "a [mechanism](#mechanism)"}}});
  static const Fields<ProblemEntry> fields(
      "problem", "A mechanism and its simulated time.",
      {{"mechanism", By(mechanism, ReadMechanism),
        "Path of a mechanism file, relative to this file; a family, with one problem per count; "
        "or a mechanism (mechanism.schema.json).",
        "the path of a mechanism file, a mechanism, or {\"family\": ...}"},
       {"horizon", NumberList(&ProblemEntry::horizons, kPositive), "Simulated time [s].",
        "a number > 0 or a list of them [s]"},
       {"name", Text(&ProblemEntry::name), "Name; default: the mechanism's name."},
       {"tags", By(ArraySchema(TextSchema()), ReadTags), "Tags for filters and tables."},
       {"scale", Number(&ProblemEntry::scale, {.min = 1e-12, .max = 1e12}),
        "Factor on all lengths. Gravity, forces and springs are scaled so that angles move as "
        "before."}});
  return fields;
}

std::vector<ExperimentProblem> ReadProblem(const JsonNode& node, MechanismFiles& files,
                                           std::size_t room) {
  ProblemEntry entry;
  entry.files = &files;
  entry.room = room;
  ProblemFields().Read(node, &entry);
  for (ExperimentProblem& problem : entry.problems) {
    // An unreadable mechanism is named after its file, so that references to it stay valid.
    const std::string own = problem.mechanism.description.name.empty()
                                ? problem.path.stem().string()
                                : problem.mechanism.description.name;
    const std::string counts = problem.name.empty() ? "" : "-" + problem.name;
    problem.name = entry.name.empty() ? own : entry.name + counts;
    if (entry.scale > 0.0 && entry.scale != 1.0) Resize(&problem.mechanism, entry.scale);
    problem.horizons = entry.horizons;
    problem.tags = entry.tags;
  }
  return std::move(entry.problems);
}

/// Returns the number of bodies except ground.
std::size_t BodiesOf(const ExperimentProblem& problem) {
  return problem.mechanism.description.bodies.size() - 1;
}

void ReadProblems(const JsonNode& node, ExperimentFile& experiment) {
  std::set<std::string> names;
  std::size_t bodies = 0;
  for (const JsonNode& element : node.Elements("problems", "at least one problem")) {
    const std::size_t room = kMaxBodies - std::min(kMaxBodies, bodies);
    for (ExperimentProblem& problem : ReadProblem(element, *experiment.files, room)) {
      if (!problem.name.empty() && !names.insert(problem.name).second) {
        element.FailAs(fmt::format("problem \"{}\" again", problem.name), "a \"name\" of its own");
      }
      bodies += BodiesOf(problem);
      experiment.problems.push_back(std::move(problem));
    }
    if (bodies > kMaxBodies) {
      element.FailAs(fmt::format("mechanisms with {} bodies so far", bodies),
                     fmt::format("at most {} in all problems", kMaxBodies));
      break;
    }
  }
}

}  // namespace

void ReadNamedFile(const JsonNode& node, const std::filesystem::path& path, std::string_view what,
                   const std::function<void()>& read) {
  std::error_code error;
  if (std::filesystem::is_regular_file(path, error)) {
    try {
      return read();
    } catch (const ConfigError& mistakes) {
      return node.errors().AddText(mistakes.what());
    }
  }
  if (std::filesystem::exists(path, error)) {
    return node.Fail(fmt::format("{} ({} is none)", what, path.string()));
  }
  std::vector<std::string> beside;
  const std::filesystem::path folder = path.has_parent_path() ? path.parent_path() : ".";
  for (const auto& entry : EntriesOf(folder)) beside.push_back(entry.filename().string());
  const std::string nearest = NearestSpelling(path.filename().string(), beside);
  const std::filesystem::path named = node.Text();
  node.Fail(fmt::format("{} ({} does not exist)", what, path.string()),
            nearest.empty() ? "" : (named.parent_path() / nearest).string());
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

FieldValue<ExperimentFile> EnsemblesValue() {
  return By(ArraySchema(EnsembleFields().Schema(), 0, kMaxRules), ReadEnsembles);
}

FieldValue<ExperimentFile> ProblemsValue() {
  return By(ArraySchema(ProblemFields().Schema(), 1), ReadProblems);
}

}  // namespace loopbench::harness
