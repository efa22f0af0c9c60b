// The sections of an experiment file, each read into its part of the experiment.
//
// Internal to harness/config. `root` is the file's top-level object.
#pragma once

#include <algorithm>
#include <filesystem>
#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "harness/config/experiment.h"
#include "harness/config/options.h"
#include "harness/json/json_reader.h"

namespace loopbench::harness {

inline constexpr Range kTolerances = {
    .min = kLeastTolerance,
    .max = 0.1,
    .above_min = true,
    .why = " (the spacing of doubles, below which rounding decides)"};
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

/// "scenes" with the mechanisms they name; a family with several counts makes several scenes.
std::vector<ExperimentScene> ReadScenes(const JsonNode& root, MechanismFiles& files,
                                        ErrorList* errors);
/// A member of a family that stands where a mechanism may, and what its counts are.
struct FamilyMember {
  MechanismFile mechanism;
  std::string counts;  ///< "10", "3x4"
};
/// All members that {"family": ...} names; `room` is how many bodies there may be.
std::vector<FamilyMember> ReadFamilyMembers(const JsonNode& node, std::size_t room);
/// A list of columns, each entry expanded.
std::vector<Column> ReadColumns(const JsonNode& node);
/// "integrator", "jacobian", "limits", "compile", "series", "timing" and "precision".
void ReadSettings(const JsonNode& root, Experiment* experiment);
/// "ensembles", after everything that they select from.
void ReadEnsembles(const JsonNode& root, const ErrorList& errors, Experiment* experiment);
/// Number of cases before exclusion.
std::size_t CountCases(const Experiment& experiment);

/// One name or a list of different names of an enum's values.
template <class Enum>
std::vector<Enum> ReadEnums(const JsonNode& node, std::string_view what) {
  static const NameList kKnown(std::vector<std::string>(kNames<Enum>.begin(), kNames<Enum>.end()));
  std::vector<Enum> values;
  for (const JsonNode& element : node.OneOrMore("names")) {
    const auto index = element.Choice(kKnown, what);
    if (!index) continue;
    const auto value = static_cast<Enum>(*index);
    const bool again = std::find(values.begin(), values.end(), value) != values.end();
    if (again) {
      element.Fail("each value once");
    } else {
      values.push_back(value);
    }
  }
  return values;
}

/// The same for a member; `fallback` when it is absent.
template <class Enum>
std::vector<Enum> ReadEnums(const JsonNode& owner, const std::string& key, std::string_view what,
                            std::vector<Enum> fallback) {
  const auto node = owner.Optional(key);
  return node ? ReadEnums<Enum>(*node, what) : std::move(fallback);
}

}  // namespace loopbench::harness
