// A run in parts on a cluster: folder, scripts for Slurm, progress.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "harness/suite/workload.h"

namespace loopbench::harness {

// Slurm's own commands: sbatch and squeue.

/// The number of the job that the script became. Throws std::runtime_error with what sbatch said.
/// @param options  before the script: "--dependency=afterany:12"
std::string SubmitJob(const std::filesystem::path& script, const std::vector<std::string>& options);

/// States of the tasks of an array job that are in the queue, "running", "pending", ... by their
/// index; empty when the job has left it. Nothing when there is no Slurm here, or it does not
/// answer: `problem` then says why.
std::optional<std::map<int, std::string>> QueuedTasks(const std::string& job, std::string* problem);

// A run in parts on several machines: the folder that they share.
//
//   DIR/cluster.json   what was asked for (ClusterRun)
//   DIR/part.sh K      runs part K, or goes on with it: all that an engine has to call
//   DIR/array.sh       the parts as an array job of Slurm; collect.sh, the job after it
//   DIR/parts/K/       store of part K; "started" when it began last, "done" when it was complete
//   DIR/logs/          what the jobs print
//   DIR/whole/         all parts in one store

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

// What engines call in the folder of a run in parts.

/// The scripts, as texts. `parts`: those that are to run, from 1.
std::string PartScript(const ClusterRun& run, const std::filesystem::path& folder);
std::string ArrayScript(const ClusterRun& run, const std::filesystem::path& folder,
                        const std::vector<int>& parts);
std::string CollectScript(const ClusterRun& run, const std::filesystem::path& folder);

// How far the parts of a run are, from their stores alone.

struct PartProgress {
  int part = 1;
  std::string state;                 ///< done, running, pending, stopped, waiting, ...
  double cases = 0.0;                ///< NaN: not counted
  std::size_t done = 0, failed = 0;  ///< different cases that finished, and that ended otherwise
  double rate = 0.0;                 ///< of records since it began last [1/s]; 0: not known
};

/// From the folder alone: a part is running when its store is locked, and else done, stopped once
/// it has begun, or waiting.
/// @param now  [s] since 1970
PartProgress ProgressOfPart(const ClusterRun& run, const std::filesystem::path& folder, int part,
                            double now);

/// Seconds until all cases are there, by the rates of the parts that run; NaN when none does.
double SecondsLeft(const ClusterRun& run, const std::vector<PartProgress>& parts);

}  // namespace loopbench::harness
