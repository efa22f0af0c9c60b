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
/// "sweep" and "exclude" (experiment_sections.h).
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

// Fields of an experiment's document by JSON Pointer, for sweeps and --set.
//
// A pointer may go through the path of a scene's mechanism: the file is then taken into the
// document. "*" as an index goes through all elements of an array. Keys that the file leaves out
// are made, since they have defaults; what the reader does not know it will refuse. Internal to
// harness/config.

/// Why a pointer names no field: in the words of a message, or a finished text.
struct FieldFault {
  std::string found, expected, suggestion;
  std::string text;      ///< of a mechanism file that cannot be read; the others are empty then
  bool of_file = false;  ///< of a mechanism file: who reads the scene will complain as well
};

/// The fields a pointer stands for, as pointers without "*".
struct FieldTargets {
  std::vector<std::string> pointers;
  std::vector<std::string> made;  ///< for each the outermost part that the file does not have
  std::optional<FieldFault> fault;
};

class ExperimentFields {
 public:
  /// `document` and `origins` change as files are taken in and values set.
  ExperimentFields(Json& document, Origins& origins, MechanismFiles& files)
      : document_(document), origins_(origins), files_(files) {}

  /// Takes in the files on the way. The document is otherwise as before.
  FieldTargets Find(const std::string& pointer);

  /// Sets one field that Find() gave.
  void Set(const std::string& pointer, const Json& value);

 private:
  void Walk(Json& node, const std::vector<std::string>& tokens, std::size_t depth,
            const std::string& pointer, FieldTargets* found);
  bool TakeIn(Json& node, const std::string& pointer, FieldTargets* found);

  Json& document_;
  Origins& origins_;
  MechanismFiles& files_;
};

/// The tokens of a JSON Pointer; nothing when it is none (no leading "/", "~" without 0 or 1).
std::optional<std::vector<std::string>> PointerTokens(const std::string& pointer);

// "sweep" of an experiment file: axes that are crossed, each the values of one field.
//
//   "sweep": [{"name": "mass", "field": "/problems/0/mechanism/bodies/1/mass", "values": [1, 2,
//   3]},
//             {"zip": [{"name": "stiffness", ...}, {"name": "damping", ...}]}]
//
// makes 3 n combinations: the axes of a zip go in step. Internal to harness/config.

struct SweepAxis {
  std::string name;
  std::string source;             ///< pointer of the axis in the experiment file
  FieldTargets fields;            ///< what each value is set to
  std::vector<Json> values;       ///< at least one
  std::vector<Value> parameters;  ///< the same as records hold them
};

/// Axes in step; a plain axis is alone.
struct SweepGroup {
  std::vector<SweepAxis> axes;
  std::size_t count() const { return axes.front().values.size(); }
};

class Sweep {
 public:
  /// Reads "sweep" and finds the fields; mistakes go to the root's errors. `settings` are the
  /// fields that --set has set: a sweep over one of them would undo it.
  Sweep(const JsonNode& root, ExperimentFields& fields, const std::vector<std::string>& settings);

  /// False when there are mistakes in it, or in a mechanism file that it goes through.
  bool sound() const { return sound_; }

  /// Number of combinations; 1 without a sweep, which is the file as it stands.
  std::size_t count() const { return count_; }

  /// Sets the fields of one combination; the last group is the fastest.
  void Apply(std::size_t combination, ExperimentFields& fields) const;

  /// Its values by name.
  Record Parameters(std::size_t combination) const;

  /// Names and numbers of values.
  std::vector<std::pair<std::string, std::size_t>> Axes() const;

  /// As ExperimentSource::EachValue().
  std::vector<std::size_t> EachValue(std::size_t most) const;

  /// Notes where values come from, for messages.
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

/// "exclude": conditions on case keys and axis names, as selections that match excluded cases.
std::vector<Selection> ReadExclusions(const JsonNode& root, const Record& keys);

}  // namespace loopbench::harness
