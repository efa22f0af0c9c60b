#include "harness/config/experiment_reader.h"

#include <fmt/format.h>

#include "harness/config/experiment_sweep.h"
#include "harness/json/document_kind.h"
#include "harness/text/config_error.h"

namespace loopbench::harness {
namespace {

/// One combination, or all there is. Mistakes go to the root's errors.
Experiment ReadOne(const JsonNode& root, MechanismFiles& files) {
  ExperimentFile experiment;
  experiment.files = &files;
  if (ExpectDocument(root, FileKind::kExperiment))
    ExperimentFileFields().ReadRows(root, &experiment);
  return experiment;
}

/// "mass = 1, damping = 0.5".
std::string Described(const Record& parameters) {
  std::string text;
  for (const auto& [name, value] : parameters.items()) {
    text += fmt::format("{}{} = {}", text.empty() ? "" : ", ", name, parameters.Text(name));
  }
  return text;
}

/// Everything from one file.
class Reader {
 public:
  Reader(std::string_view text, const std::filesystem::path& path)
      : path_(path),
        document_(ParseDocument(text, path.string())),
        origins_(path.string(), text),
        files_(path.parent_path()),
        fields_(document_, origins_, files_) {}

  void Apply(const std::vector<Setting>& settings) {
    std::string mistakes;
    for (const Setting& setting : settings) {
      const FieldTargets found = fields_.Find(setting.pointer);
      if (found.fault) {
        mistakes += (mistakes.empty() ? "" : "\n") + Explained(setting, *found.fault);
        continue;
      }
      const Json value = Parsed(setting);
      for (const std::string& pointer : found.pointers) fields_.Set(pointer, value);
      for (const std::string& made : found.made) origins_.Note(made, "from --set", "");
      set_.insert(set_.end(), found.pointers.begin(), found.pointers.end());
    }
    if (!mistakes.empty()) throw ConfigError(mistakes);
  }

  std::vector<Experiment> Read() {
    // Mistakes of the sweep itself come with those of the file as it stands.
    Origins origins = origins_;
    ErrorList errors(std::move(origins));
    const JsonNode root(document_, "", errors);
    const Sweep sweep(root, fields_, set_);
    if (!sweep.sound()) {
      ErrorList all(origins_);  // with the files that the sweep has taken in
      const JsonNode again(document_, "", all);
      Sweep(again, fields_, set_);
      ReadOne(again, files_);
      all.ThrowIfAny();
    }
    sweep.Note(&origins_);
    std::vector<Experiment> experiments;
    for (std::size_t i = 0; i < sweep.count(); ++i) {
      sweep.Apply(i, fields_);
      experiments.push_back(ReadCombination(sweep, i));
      CountOne(experiments.back());
    }
    return WithoutExcluded(std::move(experiments));
  }

 private:
  std::string Explained(const Setting& setting, const FieldFault& fault) const {
    if (!fault.text.empty()) return fault.text;
    return fmt::format(
        "{}: --set {}: found {}, expected {}{}", path_.string(), setting.pointer, fault.found,
        fault.expected,
        fault.suggestion.empty() ? "" : fmt::format(" (did you mean \"{}\"?)", fault.suggestion));
  }

  /// JSON where it is some, else a string: names need no quotes on the command line.
  static Json Parsed(const Setting& setting) {
    const std::string where = "--set " + setting.pointer;
    if (const std::string fault = EncodingFault(setting.value); !fault.empty()) {
      throw ConfigError(fmt::format("{}: {}", where, fault));
    }
    if (Json::accept(setting.value)) return ParseDocument(setting.value, where);
    return setting.value;
  }

  Experiment ReadCombination(const Sweep& sweep, std::size_t index) {
    ErrorList errors(origins_);
    const JsonNode root(document_, "", errors);
    Experiment experiment = ReadOne(root, files_);
    experiment.path = path_;
    experiment.parameters = sweep.Parameters(index);
    experiment.exclusions = ReadExclusions(root, CaseKeys(experiment, Case()));
    errors.ThrowIfAny(index == 0 ? ""
                                 : fmt::format("{}: the above in combination {} of {}: {}",
                                               path_.string(), index + 1, sweep.count(),
                                               Described(experiment.parameters)));
    return experiment;
  }

  /// Limits on the whole, while it grows.
  void CountOne(const Experiment& experiment) {
    cases_ += CountCases(experiment);
    for (const ExperimentScene& scene : experiment.scenes) {
      bodies_ += scene.mechanism.description.bodies.size();
    }
    ErrorList errors(origins_);
    if (cases_ > kMaxCases) {
      errors.Add("", fmt::format("{} cases so far", cases_),
                 fmt::format("at most {} in one file", kMaxCases));
    }
    constexpr std::size_t kMaxAllBodies = 2'000'000;  // about 1 GB
    if (bodies_ > kMaxAllBodies) {
      errors.Add("", fmt::format("mechanisms with {} bodies so far", bodies_),
                 fmt::format("at most {} in all combinations", kMaxAllBodies));
    }
    errors.ThrowIfAny();
  }

  /// A rule that excludes nothing is a mistake, as is a set of rules that excludes everything.
  std::vector<Experiment> WithoutExcluded(std::vector<Experiment> experiments) {
    const std::vector<Selection> rules = experiments.front().exclusions;
    if (rules.empty()) return experiments;
    std::vector<bool> used(rules.size());
    std::vector<Experiment> left;
    for (Experiment& experiment : experiments) {
      std::vector<Selection> own;
      own.swap(experiment.exclusions);
      bool any = false;
      for (const Case& one : Expand(experiment)) {
        bool excluded = false;
        for (std::size_t i = 0; i < rules.size(); ++i) {
          if (!Matches(one.keys, rules[i])) continue;
          used[i] = true;
          excluded = true;
        }
        any = any || !excluded;
      }
      own.swap(experiment.exclusions);
      if (any) left.push_back(std::move(experiment));
    }
    ErrorList errors(origins_);
    for (std::size_t i = 0; i < rules.size(); ++i) {
      if (used[i]) continue;
      errors.Add(fmt::format("/exclude/{}", i), "a rule that matches no case",
                 "conditions that match at least one case");
    }
    if (left.empty()) errors.Add("/exclude", "rules that match every case", "at least one case");
    errors.ThrowIfAny();
    return left;
  }

  std::filesystem::path path_;
  Json document_;
  Origins origins_;
  MechanismFiles files_;
  ExperimentFields fields_;
  std::vector<std::string> set_;
  std::size_t cases_ = 0, bodies_ = 0;
};

}  // namespace

std::size_t CountCases(const Experiment& experiment) {
  std::size_t horizons = 0;
  for (const ExperimentScene& scene : experiment.scenes) horizons += scene.horizons.size();
  return horizons * experiment.columns.size() * experiment.integrators.size() *
         (experiment.tolerances.size() + experiment.fixed_steps.size());
}

Setting ParseSetting(std::string_view text) {
  const std::size_t equals = text.find('=');
  if (equals == std::string_view::npos || text.front() != '/') {
    throw ConfigError(fmt::format(
        "--set: found \"{}\", expected /json/pointer=value, such as /scenes/0/horizon=20", text));
  }
  return {std::string(text.substr(0, equals)), std::string(text.substr(equals + 1))};
}

std::vector<Experiment> ReadExperiments(const std::filesystem::path& path,
                                        const std::vector<Setting>& settings) {
  return ParseExperiments(ReadTextFile(path), path, settings);
}

std::vector<Experiment> ParseExperiments(std::string_view text, const std::filesystem::path& path,
                                         const std::vector<Setting>& settings) {
  Reader reader(text, path);
  reader.Apply(settings);
  return reader.Read();
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

}  // namespace loopbench::harness
