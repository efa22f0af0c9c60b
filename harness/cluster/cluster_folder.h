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

inline constexpr int kMostParts = 100'000, kMostJobs = 1024;

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
/// cases than parts, or an experiment is named twice.
void CountCases(ClusterRun* run);

/// Writes cluster.json where there is none; else false, and nothing is written. Of several who try
/// at once one gets the folder.
bool MakeClusterRun(const ClusterRun& run, const std::filesystem::path& folder);
void WriteClusterRun(const ClusterRun& run, const std::filesystem::path& folder);
/// Throws ConfigError that names the file, the key, what was found and what was expected when it
/// is missing or not such a file.
ClusterRun ReadClusterRun(const std::filesystem::path& folder);

std::filesystem::path PartFolder(const std::filesystem::path& folder, int part);
bool IsDone(const std::filesystem::path& folder, int part);

}  // namespace loopbench::harness
