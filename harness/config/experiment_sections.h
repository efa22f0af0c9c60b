// The sections of an experiment file, each read into its part of the experiment.
//
// Internal to harness/config. `root` is the file's top-level object.
#pragma once

#include <algorithm>
#include <concepts>
#include <cstddef>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "harness/base/fields.h"
#include "harness/config/experiment.h"
#include "harness/config/formulations.h"
#include "harness/config/options.h"

namespace loopbench::harness {

inline constexpr Range kTolerances = {
    .min = kMinTolerance,
    .max = 0.1,
    .above_min = true,
    .why = " (the spacing of doubles, below which rounding decides)"};
/// Maximum number of points of a time series: a record of about ten series stays below 2 MB.
inline constexpr int kMaxPoints = 10'000;
inline constexpr int kMaxCount = 1'000'000;  ///< limit of counts; larger numbers are typing errors
inline constexpr std::size_t kMaxRules = 1000;      ///< ensembles, exclusions
inline constexpr std::size_t kMaxBodies = 200'000;  ///< all problems of one combination

/// Mechanism files of an experiment; each is read once for all problems and combinations.
class MechanismFiles {
 public:
  /// `folder` is the experiment's folder.
  explicit MechanismFiles(std::filesystem::path folder) : folder_(std::move(folder)) {}

  /// Returns a path of the experiment file, relative to the current folder.
  std::filesystem::path Resolve(const std::string& named) const {
    return (folder_ / named).lexically_normal();
  }
  /// Return a file's text and its document. Throw ConfigError.
  const std::string& Text(const std::filesystem::path& path);
  Json Document(const std::filesystem::path& path);
  /// Returns the mechanism of a file; every call throws ConfigError with all errors of the file.
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

/// Returns true if the file `path` named by a node exists; otherwise reports it with the nearest
/// name in the folder. `what` is the expected kind: "a mechanism file".
bool ExpectFile(const JsonNode& node, const std::filesystem::path& path, std::string_view what);

/// Experiment being read, with its mechanism files.
struct ExperimentFile : Experiment {
  MechanismFiles* files = nullptr;
};
/// Fields of an experiment file.
const Fields<ExperimentFile>& ExperimentFileFields();

/// Reader of "problems" with their mechanisms; a family with several counts gives several problems.
FieldValue<ExperimentFile> ProblemsValue();
/// Returns a list of methods, each entry expanded.
std::vector<Method> ReadMethods(const JsonNode& node);
Json MethodsSchema();
/// Fields of the sections of the same names, and of "series".
const Fields<Limits>& LimitsFields();
const Fields<CompileOptions>& CompileFields();
const Fields<AbsoluteTolerances>& AtolFields();
const Fields<Integration>& IntegrationFields();
/// Reads "integrator": names, and Butcher tables as objects or files, which are registered.
void ReadIntegrators(const JsonNode& node, ExperimentFile& experiment);
Json IntegratorsSchema();
void ReadAtol(const JsonNode& node, ExperimentFile& experiment);
Json AtolSchema();
/// Reports tables without embedding that would need one, and options without effect.
void RequireUseOfIntegrators(const JsonNode& node, ExperimentFile& experiment);
const Fields<Experiment>& SeriesFields();
const Fields<Timing>& TimingFields();
const Fields<Precision>& PrecisionFields();
const Fields<ReferenceOptions>& ReferenceFields();
const Fields<OutputOptions>& OutputFields();
/// Reports output options that conflict with the rest of the experiment.
void RequireOutput(const JsonNode& node, ExperimentFile& experiment);
/// Reads "reference" after the problems: options of certified references, or published data.
void ReadReferenceOptions(const JsonNode& node, ExperimentFile& experiment);
/// Reads "ensembles", after all sections that they select from.
void ReadEnsembles(const JsonNode& node, ExperimentFile& experiment);
Json EnsemblesSchema();
/// Schemas of "sweep" and "exclude".
Json SweepSchema();
Json ExclusionsSchema();
/// Returns the number of cases before exclusion.
std::size_t CountCases(const Experiment& experiment);

/// Returns the names of an enum's values in files.
template <class Enum>
const NameList& NamesOf() {
  static const NameList known(std::vector<std::string>(kNames<Enum>.begin(), kNames<Enum>.end()));
  return known;
}

/// Returns one or several registered names, looked up when a file is read, or the enum values of
/// their indices.
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
FieldValue<T> Methods(std::vector<Method> T::*member) {
  return {MethodsSchema(),
          [=](const JsonNode& node, T& owner) { owner.*member = ReadMethods(node); }};
}

// Fields of an experiment's document by JSON Pointer, for sweeps and --set.
//
// A pointer may go through the path of a problem's mechanism; the file is then included in the
// document. "*" as an index stands for all elements of an array. Missing keys are created, since
// they have defaults; unknown keys are rejected by the reader. Internal to harness/config.

/// Reason why a pointer names no field: parts of a message, or a complete text.
struct FieldFault {
  std::string found, expected, suggestion;
  std::string text;      ///< message of an unreadable mechanism file; the others are then empty
  bool of_file = false;  ///< fault of a mechanism file; the problem's reader reports it too
};

/// Fields that a pointer refers to, as pointers without "*".
struct FieldTargets {
  std::vector<std::string> pointers;
  std::vector<std::string> made;  ///< for each pointer the outermost part missing in the file
  std::optional<FieldFault> fault;
};

class ExperimentFields {
 public:
  /// `document` and `origins` are modified when files are included and values are set.
  ExperimentFields(Json& document, Origins& origins, MechanismFiles& files)
      : document_(document), origins_(origins), files_(files) {}

  /// Finds the fields, and includes files on the way. The document is otherwise unchanged.
  FieldTargets Find(const std::string& pointer);

  /// Sets one field from Find().
  void Set(const std::string& pointer, const Json& value);

 private:
  void Walk(Json& node, const std::vector<std::string>& tokens, std::size_t depth,
            const std::string& pointer, FieldTargets* found);
  bool TakeIn(Json& node, const std::string& pointer, FieldTargets* found);

  Json& document_;
  Origins& origins_;
  MechanismFiles& files_;
};

// "sweep" of an experiment file: axes that are crossed, each the values of one field.
//
//   "sweep": [{"name": "mass", "field": "/problems/0/mechanism/bodies/1/mass", "values": [1, 2,
//   3]},
//             {"zip": [{"name": "stiffness", ...}, {"name": "damping", ...}]}]
//
// gives 3 n combinations: the axes of a zip advance together. Internal to harness/config.

struct SweepAxis {
  std::string name;
  std::string source;             ///< pointer of the axis in the experiment file
  FieldTargets fields;            ///< fields that are set to each value
  std::vector<Json> values;       ///< at least one
  std::vector<Value> parameters;  ///< values as stored in records
};

/// Axes that advance together; a single axis outside of a zip.
struct SweepGroup {
  std::vector<SweepAxis> axes;
  std::size_t count() const { return axes.front().values.size(); }
};

class Sweep {
 public:
  /// Reads "sweep" and finds the fields; errors go to the root's list. `settings` are the fields
  /// set by --set, which a sweep must not overwrite.
  Sweep(const JsonNode& root, ExperimentFields& fields, const std::vector<std::string>& settings);

  /// Returns false if the sweep or an included mechanism file has errors.
  bool sound() const { return sound_; }

  /// Returns the number of combinations; 1 without a sweep.
  std::size_t count() const { return count_; }

  /// Sets the fields of one combination; the last group is the fastest.
  void Apply(std::size_t combination, ExperimentFields& fields) const;

  /// Returns the values of a combination by axis name.
  Record Parameters(std::size_t combination) const;

  /// Returns names of axes and numbers of values.
  std::vector<std::pair<std::string, std::size_t>> Axes() const;

  /// See ExperimentSource::EachValue().
  std::vector<std::size_t> EachValue(std::size_t most) const;

  /// Records the origin of values, for messages.
  void Note(Origins* origins) const;

 private:
  void Read(const JsonNode& node, ExperimentFields& fields,
            const std::vector<std::string>& settings);
  void CheckOverlaps(const JsonNode& node, const std::vector<std::string>& settings) const;
  std::vector<std::size_t> Indices(std::size_t combination) const;

  std::vector<SweepGroup> groups_;
  std::size_t count_ = 1;
  bool sound_ = true;
};

/// "exclude": returns conditions on case keys and axis names; excluded cases match one of them.
std::vector<Selection> ReadExclusions(const JsonNode& root, const Record& keys);

}  // namespace loopbench::harness
