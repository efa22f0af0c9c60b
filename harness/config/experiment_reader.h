// Reads experiments and the mechanisms they name from JSON (configs/schema/experiment.schema.json).
//
// A file without "sweep" is one experiment. A sweep goes through the values of fields anywhere in
// the file or in the mechanisms it names; each combination of values is an experiment of its own,
// read as if the values stood in the file, and carries them as parameters.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "harness/config/experiment.h"

namespace loopbench::harness {

/// "--set /json/pointer=value": the value of one field, set before anything is read. A pointer may
/// go through a scene's mechanism path into that file ("/scenes/0/mechanism/gravity"); "*" stands
/// for all elements of an array. Keys that the file leaves out may be set; what the reader does not
/// know it refuses as it does in the file.
struct Setting {
  std::string pointer;
  std::string value;  ///< JSON, or taken as a string when it is none
};

/// Reads "/json/pointer=value". Throws ConfigError when there is no "=" or no leading "/".
Setting ParseSetting(std::string_view text);

inline constexpr std::size_t kMaxCombinations = 100'000;  ///< of a sweep
inline constexpr std::size_t kMaxCases = 1'000'000;       ///< of a file, all combinations together

/// Reads a file; mechanism paths in it are relative to its folder. The combinations come in the
/// order of the axes, the first one slowest; those whose cases are all excluded are left out.
///
/// Besides names and ranges it refuses what would silently do nothing or do the same twice: a
/// column, scene or value listed twice, a field that two axes set, and an ensemble rule or
/// exclusion that matches no case. Throws ConfigError with all mistakes, those inside the mechanism
/// files included, one per line; of a sweep those of the first combination that has any.
std::vector<Experiment> ReadExperiments(const std::filesystem::path& path,
                                        const std::vector<Setting>& settings = {});

/// The same from text; `path` gives the name used in messages and the folder for mechanism paths.
std::vector<Experiment> ParseExperiments(std::string_view text, const std::filesystem::path& path,
                                         const std::vector<Setting>& settings = {});

/// The experiment of a file without a sweep. Throws ConfigError for a sweep of several
/// combinations.
Experiment ReadExperiment(const std::filesystem::path& path);

/// The same from text.
Experiment ParseExperiment(std::string_view text, const std::filesystem::path& path);

}  // namespace loopbench::harness
