// Reads an experiment and the mechanisms it names from JSON
// (configs/schema/experiment.schema.json).
#pragma once

#include <filesystem>
#include <string_view>

#include "harness/config/experiment.h"

namespace loopbench::harness {

/// Reads a file; mechanism paths in it are relative to its folder.
///
/// Besides names and ranges it refuses what would silently do nothing or do the same twice: a
/// column, scene or value listed twice, and an ensemble rule that matches no case. Throws
/// ConfigError with all mistakes, those inside the mechanism files included, one per line.
Experiment ReadExperiment(const std::filesystem::path& path);

/// The same from text; `path` gives the name used in messages and the folder for mechanism paths.
Experiment ParseExperiment(std::string_view text, const std::filesystem::path& path);

}  // namespace loopbench::harness
