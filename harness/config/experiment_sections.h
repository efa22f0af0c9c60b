// The sections of an experiment file, each read into its part of the experiment.
//
// Internal to harness/config. `root` is the file's top-level object.
#pragma once

#include <algorithm>
#include <concepts>
#include <filesystem>
#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "harness/config/experiment.h"
#include "harness/config/formulations.h"
#include "harness/config/options.h"
#include "harness/json/fields.h"

namespace loopbench::harness {

inline constexpr Range kTolerances = {
    .min = kLeastTolerance,
    .max = 0.1,
    .above_min = true,
    .why = " (the spacing of doubles, below which rounding decides)"};
/// Of a series: a picture has fewer points across, and a record of some ten series stays below 2
/// MB.
inline constexpr int kMostPoints = 10'000;
inline constexpr int kMaxCount = 1'000'000;  ///< of anything: beyond it a number is a typing error
inline constexpr std::size_t kMaxRules = 1000;      ///< ensembles, exclusions
inline constexpr std::size_t kMaxBodies = 200'000;  ///< of all scenes of one combination

/// The mechanism files of an experiment, each read once however many scenes and combinations use
/// it.
class MechanismFiles {
 public:
  /// `folder` is the experiment's.
  explicit MechanismFiles(std::filesystem::path folder) : folder_(std::move(folder)) {}

  /// A path as the experiment writes it, seen from here.
  std::filesystem::path Resolve(const std::string& named) const {
    return (folder_ / named).lexically_normal();
  }
  /// A file's text, and the document in it. Throw ConfigError.
  const std::string& Text(const std::filesystem::path& path);
  Json Document(const std::filesystem::path& path);
  /// The mechanism in a file; throws ConfigError with all its mistakes, each time it is asked for.
  const MechanismFile& Mechanism(const std::filesystem::path& path);

 private:
  struct File {
    MechanismFile mechanism;
    std::string mistakes;
  };
  std::filesystem::path folder_;
  std::map<std::filesystem::path, std::string> texts_;
  std::map<std::filesystem::path, File> files_;
};

/// Whether there is a file at `path`, which a node names; reports one that is not there with the
/// nearest name beside it. `what` it should be: "a mechanism file".
bool ExpectFile(const JsonNode& node, const std::filesystem::path& path, std::string_view what);

/// An experiment and what reading it needs besides.
struct ExperimentFile : Experiment {
  MechanismFiles* files = nullptr;
};
/// All that an experiment file may hold.
const Fields<ExperimentFile>& ExperimentFileFields();

/// "scenes" with the mechanisms they name; a family with several counts makes several scenes.
FieldValue<ExperimentFile> ScenesValue();
/// A member of a family that stands where a mechanism may, and what its counts are.
struct FamilyMember {
  MechanismFile mechanism;
  std::string counts;  ///< "10", "3x4"
};
/// All members that {"family": ...} names; `room` is how many bodies there may be.
std::vector<FamilyMember> ReadFamilyMembers(const JsonNode& node, std::size_t room);
Json FamilySchema();
/// A list of columns, each entry expanded.
std::vector<Column> ReadColumns(const JsonNode& node);
Json ColumnsSchema();
/// The sections of the same names, and "series".
const Fields<Limits>& LimitsFields();
const Fields<CompileOptions>& CompileFields();
const Fields<Experiment>& SeriesFields();
const Fields<Timing>& TimingFields();
const Fields<Precision>& PrecisionFields();
const Fields<ReferenceOptions>& ReferenceFields();
const Fields<OutputOptions>& OutputFields();
/// Reports output that the rest of the experiment rules out.
void RequireOutput(const JsonNode& node, ExperimentFile& experiment);
/// "reference", after the scenes: options of certified ones, or the published series of scenes.
void ReadReferenceOptions(const JsonNode& node, ExperimentFile& experiment);
/// "ensembles", after everything that they select from.
void ReadEnsembles(const JsonNode& node, ExperimentFile& experiment);
Json EnsemblesSchema();
/// "sweep" and "exclude" (experiment_sweep.h).
Json SweepSchema();
Json ExclusionsSchema();
/// Number of cases before exclusion.
std::size_t CountCases(const Experiment& experiment);

/// Names of an enum's values in files.
template <class Enum>
const NameList& NamesOf() {
  static const NameList known(std::vector<std::string>(kNames<Enum>.begin(), kNames<Enum>.end()));
  return known;
}

/// One or several of the names that are registered when a file is read, or the enum values that
/// their indices are.
template <class T, class Chosen>
FieldValue<T> RegisteredChoices(std::vector<Chosen> T::*member, std::vector<std::string> (*names)(),
                                std::string what) {
  return {OneOrMoreSchema(ChoiceSchema(names()), true), [=](const JsonNode& node, T& owner) {
            const NameList known(names());
            (owner.*member).clear();
            for (const std::size_t index : node.Choices(known, what)) {
              if constexpr (std::same_as<Chosen, std::string>) {
                (owner.*member).push_back(known.all()[index]);
              } else {
                (owner.*member).push_back(static_cast<Chosen>(index));
              }
            }
          }};
}
template <class T>
FieldValue<T> FormulationChoices(std::vector<std::string> T::*member) {
  return RegisteredChoices(member, FormulationNames, "a formulation");
}
template <class T>
FieldValue<T> LevelChoices(std::vector<Enforcement> T::*member) {
  return RegisteredChoices(member, LevelNames, "a level of enforcement");
}

template <class T>
FieldValue<T> Columns(std::vector<Column> T::*member) {
  return {ColumnsSchema(),
          [=](const JsonNode& node, T& owner) { owner.*member = ReadColumns(node); }};
}

}  // namespace loopbench::harness
