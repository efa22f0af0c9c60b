// A run in parts on several machines: the folder that they share.
//
//   DIR/cluster.json   what was asked for (ClusterRun)
//   DIR/part.sh K      runs part K, or goes on with it: all that an engine has to call
//   DIR/array.sh       the parts as an array job of Slurm; collect.sh, the job after it
//   DIR/parts/K/       store of part K; "started" when it began last, "done" when it was complete
//   DIR/logs/          what the jobs print
//   DIR/whole/         all parts in one store
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "harness/suite/long_sweep.h"

namespace loopbench::harness {

/// What runs, in how many parts, and what is known of the jobs.
struct ClusterRun {
  std::vector<std::filesystem::path> experiments;  ///< absolute
  std::vector<std::string> settings, conditions;   ///< --set and --filter, as typed
  int parts = 1;
  int jobs = 1;  ///< cases at once in a part
  bool timing = true;
  bool isolate = false;
  std::vector<std::string> batch_options;  ///< for sbatch: "--time=1:00:00", ...
  std::string program;                     ///< absolute path of loopbench on every machine
  std::string name;                        ///< of the first experiment
  std::vector<double> cases;               ///< accuracy cases of each part; NaN: not counted
  std::int64_t all_cases = 0;
  std::string array_job, collect_job;  ///< Slurm's numbers; "" before
};

/// The experiments with their selection, as other commands take them.
ExperimentFiles FilesOf(const ClusterRun& run);

/// Reads all that runs, and counts it. Throws ConfigError as `run` does, and when there are fewer
/// cases than parts.
void CountCases(ClusterRun* run);

void WriteClusterRun(const ClusterRun& run, const std::filesystem::path& folder);
/// Throws ConfigError that names the file when it is missing or not such a file.
ClusterRun ReadClusterRun(const std::filesystem::path& folder);

std::filesystem::path PartFolder(const std::filesystem::path& folder, int part);
bool IsDone(const std::filesystem::path& folder, int part);

/// The scripts, as texts. `parts`: those that are to run, from 1.
std::string PartScript(const ClusterRun& run, const std::filesystem::path& folder);
std::string ArrayScript(const ClusterRun& run, const std::filesystem::path& folder,
                        const std::vector<int>& parts);
std::string CollectScript(const ClusterRun& run, const std::filesystem::path& folder);

}  // namespace loopbench::harness
