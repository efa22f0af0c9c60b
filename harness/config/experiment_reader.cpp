#include "harness/config/experiment_reader.h"

#include <fmt/format.h>

#include "harness/config/experiment_sections.h"
#include "harness/text/config_error.h"

namespace loopbench::harness {

std::vector<Experiment> ReadExperiments(const std::filesystem::path& path,
                                        const std::vector<Setting>& settings) {
  return ExperimentSource(path, settings).ReadAll();
}

std::vector<Experiment> ParseExperiments(std::string_view text, const std::filesystem::path& path,
                                         const std::vector<Setting>& settings) {
  return ExperimentSource(std::string(text), path, settings).ReadAll();
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
