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

/// Calls `read` if the file `path` named by a node exists, and adds errors of that file to those of
/// the node's file. Reports a missing file with the nearest name in the folder. `what` is the
/// expected kind: "a mechanism file".
void ReadNamedFile(const JsonNode& node, const std::filesystem::path& path, std::string_view what,
                   const std::function<void()>& read);

/// Experiment being read, with its mechanism files.
struct ExperimentFile : Experiment {
  MechanismFiles* files = nullptr;
};
/// Fields of the sections of the same names. A family with several counts gives several problems.
FieldValue<ExperimentFile> ProblemsValue();
FieldValue<ExperimentFile> IntegratorsValue();
FieldValue<ExperimentFile> AtolValue();
/// "reference" after the problems: options of certified references, or published data.
FieldValue<ExperimentFile> ReferenceValue();
/// "ensembles" after all sections that they select from.
FieldValue<ExperimentFile> EnsemblesValue();
/// Fields of the sections of the same names, and of "series".
const Fields<Limits>& LimitsFields();
const Fields<CompileOptions>& CompileFields();
const Fields<AbsoluteTolerances>& AtolFields();
const Fields<Integration>& IntegrationFields();
/// Returns true if cases use this option: lengths of steps unless steps are fixed, options of
/// Newton's iteration if the profile is implicit.
bool UsesOption(std::string_view option, bool is_implicit, bool is_fixed);
const Fields<Experiment>& SeriesFields();
const Fields<Timing>& TimingFields();
const Fields<Precision>& PrecisionFields();
const Fields<OutputOptions>& OutputFields();
/// Returns a list of methods, each entry expanded.
std::vector<Method> ReadMethods(const JsonNode& node);
Json MethodsSchema();
/// Schemas of "sweep" and "exclude".
Json SweepSchema();
Json ExclusionsSchema();
/// Reports tables without embedding that would need one, and options without effect.
void RequireUseOfIntegrators(const JsonNode& node, ExperimentFile& experiment);
/// Reports output options that conflict with the rest of the experiment.
void RequireOutput(const JsonNode& node, ExperimentFile& experiment);
/// Returns the number of cases before exclusion.
std::size_t CountCases(const Experiment& experiment);

/// Returns the names of an enum's values in files.
template <class Enum>
const NameList& NamesOf() {
  static const NameList known(std::vector<std::string>(kNames<Enum>.begin(), kNames<Enum>.end()));
  return known;
}

template <class T>
FieldValue<T> Methods(std::vector<Method> T::*member) {
  return {MethodsSchema(),
          [=](const JsonNode& node, T& owner) { owner.*member = ReadMethods(node); }};
}

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

/// Document of an experiment file, with included mechanism files and values that were set.
///
/// Fields are found by JSON Pointer, for sweeps and --set. A pointer may go through the path of a
/// problem's mechanism; the file is then included. "*" as an index stands for all elements of an
/// array. Missing keys are created, since they have defaults; the reader rejects unknown keys.
struct ExperimentDocument {
  ExperimentDocument(std::string file_text, const std::filesystem::path& file)
      : text(std::move(file_text)),
        path(file),
        json(ParseDocument(text, path.string())),
        origins(path.string(), text),
        files(path.parent_path()) {}

  /// Finds the fields, and includes files on the way. The document is otherwise unchanged.
  FieldTargets Find(const std::string& pointer);

  /// Sets one field from Find().
  void Set(const std::string& pointer, const Json& value);

  std::string text;  ///< of the file
  std::filesystem::path path;
  Json json;
  Origins origins;
  MechanismFiles files;
};

/// Axis of "sweep": the values of one field.
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

/// "sweep" of an experiment file: groups that are crossed.
struct Sweep {
  Sweep() = default;
  /// Reads "sweep" and finds the fields; errors go to the root's list. `settings` are the fields
  /// set by --set, which a sweep must not overwrite.
  Sweep(const JsonNode& root, ExperimentDocument& document,
        const std::vector<std::string>& settings);

  /// Sets the fields of one combination; the last group is the fastest.
  void Apply(std::size_t combination, ExperimentDocument& document) const;

  /// Returns the values of a combination by axis name.
  Record Parameters(std::size_t combination) const;

  /// Returns the index of each group's values in a combination.
  std::vector<std::size_t> Indices(std::size_t combination) const;

  /// Records the origin of values, for messages.
  void Note(Origins* origins) const;

  std::vector<SweepGroup> groups;
  std::size_t count = 1;  ///< number of combinations; 1 without a sweep
  bool is_sound = true;   ///< false if the sweep or an included mechanism file has errors
};

/// "exclude": returns conditions on case keys and axis names; excluded cases match one of them.
std::vector<Selection> ReadExclusions(const JsonNode& root, const Record& keys);

}  // namespace loopbench::harness
