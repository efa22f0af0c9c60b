#include "harness/config/experiment_reader.h"

#include <ranges>
#include <set>

#include "harness/base/text.h"
#include "harness/config/experiment_sections.h"
#include "harness/config/file_schemas.h"

namespace loopbench::harness {
namespace {

using File = ExperimentFile;

void ReadAllMethods(const JsonNode& node, File& file) {
  file.methods = file.timing.methods = ReadMethods(node);
}

/// Reads tolerances. An empty list is equal to a missing key; see RequireSteps().
void ReadAnyTolerances(const JsonNode& node, File& file) {
  const bool is_empty = node.value().is_array() && node.value().empty();
  if (!is_empty) file.tolerances = node.NumberList(kTolerances);
}

/// Reports an experiment that has neither tolerances nor steps.
void RequireSteps(const JsonNode& node, File&) {
  if (node.Optional("fixed_steps")) return;
  const auto tolerances = node.Required("tolerances", "a list of numbers, or \"fixed_steps\"");
  const bool is_empty = tolerances && tolerances->value().is_array() && tolerances->value().empty();
  if (is_empty) tolerances->Fail("at least one tolerance, or \"fixed_steps\" beside it");
}

/// Reports peers, which have their own integrators, beside options of integrators.
void RequireNoPeerOfOptions(const JsonNode& node, File& file) {
  // timings have no fixed steps
  std::vector<Method> all = file.methods;
  all.insert(all.end(), file.timing.methods.begin(), file.timing.methods.end());
  for (const auto& [key, what, methods] : {std::tuple("fixed_steps", "fixed steps", &file.methods),
                                           std::tuple("atol", "absolute tolerances", &all),
                                           std::tuple("integration", "options", &all)}) {
    const auto peer = std::ranges::find_if(*methods, IsPeer);
    const auto option = node.Optional(key);
    if (!option || peer == methods->end()) continue;
    option->FailAs(
        fmt::format("{} of \"{}\", which has its own integrator", what, peer->formulation),
        "\"tolerances\" alone, or an experiment of its own for peers");
  }
}

void ReadPrecision(const JsonNode& node, File& file) {
  file.precision.tolerances = file.tolerances;
  if (!PrecisionFields().Read(node, &file.precision)) return;
  if (file.precision.scalars.empty() || !file.precision.tolerances.empty()) return;
  if (node.Optional("tolerances")) return;  // has been reported
  node.FailAs("no \"tolerances\", and none in the experiment", "tolerances of the ladders");
}

/// Reports levels without the derivative that an implicit profile needs.
void RequireDerivatives(const JsonNode& node, File& file) {
  const auto integrator = node.Optional("integrator");
  if (!integrator || file.jacobian != JacobianKind::kForward) return;
  const auto implicit = std::ranges::find_if(
      file.integrators, [](const std::string& name) { return FindProfile(name)->is_implicit; });
  if (implicit == file.integrators.end()) return;
  const Profile* profile = FindProfile(*implicit);
  for (const auto& methods : {file.methods, file.timing.methods}) {
    for (const Method& method : methods) {
      const LevelTraits& level = TraitsOf(method.enforcement);
      if (level.has_derivative) continue;
      integrator->FailAs(
          fmt::format("\"{}\" at level \"{}\", which has no derivative", profile->name, level.name),
          "\"jacobian\": \"finite-difference\" beside it");
      return;
    }
  }
}

const Fields<File>& FileFields() {
  static const Json some_or_none = EitherSchema(
      {NumberListSchema(kTolerances), {{"type", "array"}, {"maxItems", 0}, {"words", "[]"}}});
  static const Json one_of_both = {
      {"if", {{"not", Requires({"fixed_steps"})}}},
      {"then",
       {{"required", {"tolerances"}}, {"properties", {{"tolerances", {{"minItems", 1}}}}}}}};
  static const Fields<File> fields(
      "experiment",
      "Mechanisms, methods, tolerances and horizons to run. Lists expand as a cross product. The "
      "program also checks that mechanism files exist and are valid, that problems and methods "
      "are different, that fields of a sweep exist, that ranges have two different ends, and "
      "that every ensemble and exclusion matches a case.",
      DocumentRows<File>(
          {{"name", Text(&File::name), "Name of the experiment.", "a name"},
           {"comment", Text(&File::comment), "Free text for readers."},
           {"problems", ProblemsValue(), "Problems: a mechanism and a duration each.",
            "an array of problems"},
           {"methods", By(MethodsSchema(), ReadAllMethods),
            "Methods that impose the loop constraints.", "an array of methods"},
           {"tolerances", By(some_or_none, ReadAnyTolerances),
            "Relative tolerances of the integrator, above the spacing of doubles; absolute ones, "
            "too, unless atol is given. Optional, or [], if fixed_steps is given."},
           {"fixed_steps", NumberList(&File::fixed_steps, kPositive),
            "Fixed step lengths [s]: each adds cases in which all steps have this length (the "
            "last step is clipped) and no error test is made. Not for peers."},
           {"", By(one_of_both, RequireSteps)},
           {"atol", AtolValue(),
            "Absolute tolerance of every component of the state, or by quantity; default: as the "
            "relative tolerance."},
           {"integration", Object(&File::integration, IntegrationFields())},
           {"refine", Bool(&File::refine),
            "If true, every case runs again, at a tenth of its tolerance or half its step. Records "
            "then contain refinement_difference, the largest difference of final poses. A "
            "difference above 1000 tolerances, or above 0.01 with fixed steps, sets the warning "
            "refinement. Cases with fixed steps and no reference always run again."},
           {"integrator", IntegratorsValue(),
            "Integrators: profiles (Runge-Kutta pairs with norm and controller), tables of ARKODE "
            "by "
            "their names (loopbench integrators), Butcher tables, or files of such tables relative "
            "to this file. Crossed with all other lists."},
           {"jacobian", Choice(&File::jacobian, NamesOf<JacobianKind>(), "a kind of Jacobian"),
            "Jacobians of implicit profiles: by forward differentiation or finite differences."},
           {"limits", Object(&File::limits, LimitsFields())},
           {"preprocess", Object(&File::compile, CompileFields())},
           {"series", Section(SeriesFields())},
           {"timing", Object(&File::timing, TimingFields())},
           {"", By(Json::object(), RequireNoPeerOfOptions)},
           {"precision", By(PrecisionFields().Schema(), ReadPrecision)},
           {"reference", ReferenceValue()},
           {"output", OptionalObject(&File::output, OutputFields())},
           {"", By(Json::object(), RequireOutput)},
           {"ensembles", EnsemblesValue(), "Perturbed repetitions of cases."},
           {"sweep", SweepSchema(),
            "Sweep axes, crossed with the first axis slowest. Each combination of values is run "
            "as if the values were in this file. Axes in a zip advance together. At most "
            "10000000 combinations."},
           {"exclude", ExclusionsSchema(),
            "Rules: cases that match all conditions of a rule are left out. Keys are mechanism, "
            "formulation, enforcement, coordinates, solver, integrator, rtol, atol, step, "
            "horizon and the names of axes."},
           {"", By(Json::object(), RequireDerivatives)},
           {"", By(Json::object(), RequireUseOfIntegrators)}}));
  return fields;
}

/// Reads one combination. Errors are added to the root's list.
Experiment ReadOne(const JsonNode& root, MechanismFiles& files) {
  ExperimentFile experiment;
  experiment.files = &files;
  if (ExpectDocument(root, FileKind::kExperiment)) FileFields().ReadRows(root, &experiment);
  return experiment;
}

/// Records which rules of "exclude" have matched, and whether any case is left.
class ExclusionUse {
 public:
  explicit ExclusionUse(const std::vector<Selection>& rules) : rules_(rules), used_(rules.size()) {}

  /// Returns true if the experiment has a case that no rule excludes.
  bool Look(Experiment& experiment) {
    if (rules_.empty()) return any_left_ = true;
    const std::vector<Selection> own = std::exchange(experiment.exclusions, {});
    bool any = false;
    for (const Case& one : Expand(experiment)) {
      bool excluded = false;
      for (std::size_t i = 0; i < rules_.size(); ++i) {
        if (!Matches(one.keys, rules_[i])) continue;
        used_[i] = true;
        excluded = true;
      }
      any = any || !excluded;
    }
    experiment.exclusions = own;
    any_left_ = any_left_ || any;
    return any;
  }

  bool is_sure() const { return any_left_ && std::ranges::find(used_, false) == used_.end(); }

  /// Throws ConfigError for rules that exclude nothing, and rules that exclude all cases.
  void Require(const Origins& origins) const {
    ErrorList errors(origins);
    for (std::size_t i = 0; i < rules_.size(); ++i) {
      if (used_[i]) continue;
      errors.Add(fmt::format("/exclude/{}", i), "a rule that matches no case",
                 "conditions that match at least one case");
    }
    if (!any_left_) errors.Add("/exclude", "rules that match every case", "at least one case");
    errors.ThrowIfAny();
  }

 private:
  std::vector<Selection> rules_;
  std::vector<bool> used_;
  bool any_left_ = false;
};

/// Returns JSON if valid, otherwise a string: names need no quotes on the command line.
Json Parsed(const Setting& setting) {
  const std::string where = "--set " + setting.pointer;
  if (const std::string fault = EncodingFault(setting.value); !fault.empty()) {
    throw ConfigError(fmt::format("{}: {}", where, fault));
  }
  if (Json::accept(setting.value)) return ParseDocument(setting.value, where);
  return setting.value;
}

/// Applies settings and returns the pointers of the fields.
std::vector<std::string> Apply(const std::vector<Setting>& settings, ExperimentDocument& document) {
  std::vector<std::string> set, mistakes;
  for (const Setting& setting : settings) {
    const FieldTargets found = document.Find(setting.pointer);
    if (const auto& fault = found.fault) {
      mistakes.push_back(
          !fault->text.empty()
              ? fault->text
              : fmt::format("{}: --set {}: found {}, expected {}{}", document.path.string(),
                            setting.pointer, fault->found, fault->expected,
                            fault->suggestion.empty()
                                ? ""
                                : fmt::format(" (did you mean \"{}\"?)", fault->suggestion)));
      continue;
    }
    const Json value = Parsed(setting);
    for (const std::string& pointer : found.pointers) document.Set(pointer, value);
    for (const std::string& made : found.made) document.origins.Note(made, "from --set", "");
    set.insert(set.end(), found.pointers.begin(), found.pointers.end());
  }
  if (!mistakes.empty()) throw ConfigError(fmt::format("{}", fmt::join(mistakes, "\n")));
  return set;
}

/// Reads the sweep. Its errors are reported with errors of the unchanged file.
Sweep ReadSweep(ExperimentDocument& document, const std::vector<std::string>& set) {
  ErrorList errors(document.origins);
  Sweep sweep(JsonNode(document.json, "", errors), document, set);
  if (!sweep.is_sound) {
    ErrorList all(document.origins);  // with the files included by the sweep
    const JsonNode again(document.json, "", all);
    Sweep(again, document, set);
    ReadOne(again, document.files);
    all.ThrowIfAny();
  }
  sweep.Note(&document.origins);
  return sweep;
}

}  // namespace

std::size_t CountCases(const Experiment& experiment) {
  std::size_t horizons = 0;
  for (const ExperimentProblem& problem : experiment.problems) horizons += problem.horizons.size();
  return horizons * experiment.methods.size() * experiment.integrators.size() *
         (experiment.tolerances.size() + experiment.fixed_steps.size());
}

Setting ParseSetting(std::string_view text) {
  const std::size_t equals = text.find('=');
  if (equals == std::string_view::npos || text.front() != '/') {
    throw ConfigError(fmt::format(
        "--set: found \"{}\", expected /json/pointer=value, such as /problems/0/horizon=20", text));
  }
  return {std::string(text.substr(0, equals)), std::string(text.substr(equals + 1))};
}

/// The file and its sweep.
struct ExperimentSource::Document : ExperimentDocument {
  using ExperimentDocument::ExperimentDocument;
  Sweep sweep;
};

ExperimentSource::ExperimentSource(const std::filesystem::path& path,
                                   const std::vector<Setting>& settings)
    : ExperimentSource(ReadTextFile(path), path, settings) {}

ExperimentSource::ExperimentSource(std::string text, const std::filesystem::path& path,
                                   const std::vector<Setting>& settings)
    : document_(std::make_unique<Document>(std::move(text), path)) {
  document_->sweep = ReadSweep(*document_, Apply(settings, *document_));
}

ExperimentSource::~ExperimentSource() = default;
ExperimentSource::ExperimentSource(ExperimentSource&&) noexcept = default;

const std::filesystem::path& ExperimentSource::path() const { return document_->path; }

std::size_t ExperimentSource::count() const { return document_->sweep.count; }

std::vector<std::pair<std::string, std::size_t>> ExperimentSource::axes() const {
  std::vector<std::pair<std::string, std::size_t>> axes;
  for (const SweepGroup& group : document_->sweep.groups) {
    for (const SweepAxis& axis : group.axes) axes.emplace_back(axis.name, axis.values.size());
  }
  return axes;
}

Record ExperimentSource::Parameters(std::size_t combination) const {
  return document_->sweep.Parameters(combination);
}

std::vector<std::size_t> ExperimentSource::EachValue(std::size_t most) const {
  std::set<std::size_t> combinations = {0, count() - 1};
  std::size_t stride = 1;  // between neighbouring values of the group
  for (const SweepGroup& group : document_->sweep.groups | std::views::reverse) {
    const std::size_t values = group.count(), taken = std::min(values, most);
    for (std::size_t k = 1; k < taken; ++k) {
      combinations.insert(stride * (k * (values - 1) / (taken - 1)));
    }
    stride *= values;
  }
  return {combinations.begin(), combinations.end()};
}

std::string ExperimentSource::Text() const { return CompactText(document_->json); }

Experiment ExperimentSource::Read(std::size_t combination) {
  document_->sweep.Apply(combination, *document_);
  ErrorList errors(document_->origins);
  const JsonNode root(document_->json, "", errors);
  Experiment experiment = ReadOne(root, document_->files);
  experiment.path = path();
  experiment.parameters = Parameters(combination);
  experiment.exclusions = ReadExclusions(root, CaseKeys(experiment, Case()));
  errors.ThrowIfAny(combination == 0
                        ? ""
                        : fmt::format("{}: the above in combination {} of {}: {}", path().string(),
                                      combination + 1, count(), experiment.parameters.Described()));
  return experiment;
}

std::vector<Experiment> ExperimentSource::ReadAll() {
  const auto refuse_if = [this](bool refused, const char* pointer, const std::string& found,
                                const std::string& expected) {
    if (!refused) return;
    ErrorList errors(document_->origins);
    errors.Add(pointer, found, expected);
    errors.ThrowIfAny();
  };
  refuse_if(count() > kMaxInMemory, "/sweep", fmt::format("{} combinations", count()),
            fmt::format("at most {} to be held at once", kMaxInMemory));
  std::vector<Experiment> experiments;
  std::size_t cases = 0, bodies = 0;
  for (std::size_t i = 0; i < count(); ++i) {
    experiments.push_back(Read(i));
    cases += CountCases(experiments.back());
    refuse_if(cases > kMaxHeldCases, "", fmt::format("{} cases so far", cases),
              fmt::format("at most {} to be held at once", kMaxHeldCases));
    for (const ExperimentProblem& problem : experiments.back().problems) {
      bodies += problem.mechanism.description.bodies.size();
    }
    constexpr std::size_t kMaxAllBodies = 2'000'000;  // about 1 GB
    refuse_if(bodies > kMaxAllBodies, "", fmt::format("mechanisms with {} bodies so far", bodies),
              fmt::format("at most {} in all combinations", kMaxAllBodies));
  }
  ExclusionUse use(experiments.front().exclusions);
  std::erase_if(experiments, [&use](Experiment& one) { return !use.Look(one); });
  use.Require(document_->origins);
  return experiments;
}

void ExperimentSource::CheckExclusions(const std::vector<std::size_t>& sample) {
  ExclusionUse use(Read(0).exclusions);
  const auto look = [&](std::size_t i) {
    Experiment experiment = Read(i);
    use.Look(experiment);
  };
  for (const std::size_t i : sample) look(i);
  for (std::size_t i = 0; i < count() && !use.is_sure(); ++i) look(i);
  use.Require(document_->origins);
}

std::vector<Experiment> ReadExperiments(const std::filesystem::path& path,
                                        const std::vector<Setting>& settings) {
  return ExperimentSource(path, settings).ReadAll();
}

std::vector<Experiment> ParseExperiments(std::string_view text, const std::filesystem::path& path,
                                         const std::vector<Setting>& settings) {
  return ExperimentSource(std::string(text), path, settings).ReadAll();
}

Experiment ReadExperiment(const std::filesystem::path& path) {
  return ParseExperiment(ReadTextFile(path), path);
}

Experiment ParseExperiment(std::string_view text, const std::filesystem::path& path) {
  std::vector<Experiment> experiments = ParseExperiments(text, path);
  if (experiments.size() > 1) {
    throw ConfigError(fmt::format("{}: /sweep: found {} combinations, expected one experiment",
                                  path.string(), experiments.size()));
  }
  return std::move(experiments.front());
}

Json ExperimentSchema() { return FileFields().OwnSchema(); }

std::string ExperimentText(const SingleRun& run) {
  Json method = {{"formulation", run.method.formulation},
                 {"enforcement", ToString(run.method.enforcement)},
                 {"coordinates", ToString(run.method.coordinates)}};
  Json experiment = {
      {"name", run.name},
      {"comment", run.comment},
      {"problems",
       Json::array({{{"mechanism", run.mechanism.generic_string()}, {"horizon", run.horizon}}})},
      {"methods", Json::array({method})},
      {"integrator", run.integrator},
      {"timing", {{"cases", true}}},
      {"reference",
       {{"scalar", run.reference.scalar},
        {"points", run.reference.points},
        {"cpu_s", run.reference.cpu_s}}}};
  if (run.step > 0.0) {
    experiment["fixed_steps"] = Json::array({run.step});
  } else {
    experiment["tolerances"] = Json::array({run.rtol});
  }
  return experiment.dump(2) + "\n";
}

std::string LadderText(const LadderFile& ladder) {
  Json problems = Json::array();
  for (const std::string& mechanism : ladder.mechanisms) {
    problems.push_back({{"mechanism", mechanism}, {"horizon", ladder.horizon}});
  }
  const Json methods = Json::array({{{"formulation", {"odca", "lagrange", "reduction"}},
                                     {"enforcement", "projection"},
                                     {"coordinates", "joint"}}});
  const Json file = {
      {"name", ladder.name},
      {"comment", ladder.comment},
      {"problems", problems},
      {"methods", methods},
      {"tolerances", {1e-6, 1e-9}},
      {"integrator", "dormand-prince"},
      {"preprocess",
       {{"planar", false}, {"welds", false}, {"immovable", false}, {"islands", false}}},
      {"timing", {{"repeats", 5}}}};
  return JsonText(file);
}

}  // namespace loopbench::harness
