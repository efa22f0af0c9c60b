// The sections of an experiment file, each read into its part of the experiment.
//
// Internal to harness/config. `root` is the file's top-level object.
#pragma once

#include <algorithm>
#include <filesystem>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "harness/config/experiment.h"
#include "harness/config/json_reader.h"

namespace loopbench::harness {

inline constexpr Range kTolerances = {.min = 0.0, .max = 0.1, .above_min = true};
inline constexpr int kMaxCount = 1'000'000;  ///< of anything: beyond it a number is a typing error

/// "scenes" with the mechanisms they name; `folder` is the experiment's.
std::vector<ExperimentScene> ReadScenes(const JsonNode& root, const std::filesystem::path& folder,
                                        ErrorList* errors);
/// A list of columns, each entry expanded.
std::vector<Column> ReadColumns(const JsonNode& node);
/// "ensembles", after everything that they select from.
void ReadEnsembles(const JsonNode& root, const ErrorList& errors, Experiment* experiment);

/// One name or a list of different names of an enum's values.
template <class Enum>
std::vector<Enum> ReadEnums(const JsonNode& node, std::string_view what) {
  const std::vector<std::string> names(kNames<Enum>.begin(), kNames<Enum>.end());
  std::vector<Enum> values;
  for (const JsonNode& element : node.OneOrMore("names")) {
    const auto index = element.Choice(names, what);
    if (!index) continue;
    const auto value = static_cast<Enum>(*index);
    const bool again = std::find(values.begin(), values.end(), value) != values.end();
    if (again) element.Fail("each value once");
    values.push_back(value);
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
