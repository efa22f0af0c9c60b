// Experiments and the mechanisms they name, read whole from JSON
// (configs/schema/experiment.schema.json).
#pragma once

#include <filesystem>
#include <string_view>
#include <vector>

#include "harness/config/experiment_source.h"

namespace loopbench::harness {

/// All combinations of a file (ExperimentSource::ReadAll()).
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
