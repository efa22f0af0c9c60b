// Runs divided into parts on a cluster: folder, Slurm scripts, progress.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "harness/suite/suite.h"

namespace loopbench::harness {

// The Slurm commands sbatch and squeue.

/// Submits a script; returns its job number. Throws std::runtime_error with the message of sbatch.
/// @param options  arguments before the script: "--dependency=afterany:12"
std::string SubmitJob(const std::filesystem::path& script, const std::vector<std::string>& options);

/// Returns the states of the queued tasks of an array job by index, "running", "pending", ...;
/// empty if the job has left the queue. Returns nothing if Slurm is absent or does not answer;
/// `problem` is then the reason.
std::optional<std::map<int, std::string>> QueuedTasks(const std::string& job, std::string* problem);

// The shared folder of a run in parts on several machines.
//
//   DIR/cluster.json   settings of the run (ClusterRun)
//   DIR/part.sh K      runs or resumes part K: the only command that an engine needs
//   DIR/array.sh       the parts as an array job of Slurm; collect.sh, the job after it
//   DIR/parts/K/       store of part K; files "started" (latest start) and "done" (completion)
//   DIR/logs/          output of the jobs
//   DIR/whole/         all parts in one store

inline constexpr int kMaxParts = 100'000, kMaxJobs = 1024;

/// Content and number of parts of a run, with its known jobs.
struct ClusterRun {
  std::vector<std::filesystem::path> experiments;  ///< absolute
  std::vector<std::string> settings, conditions;   ///< --set and --filter, as typed
  int parts = 1;
  int jobs = 1;  ///< simultaneous cases in a part
  bool timing = true;
  bool isolate = false;
  std::vector<std::string> batch_options;  ///< options of sbatch: "--time=1:00:00", ...
  std::string program;                     ///< absolute path of loopbench on every machine
  std::string name;                        ///< name of the first experiment
  std::vector<double> cases;               ///< accuracy cases of each part; NaN: not counted
  std::int64_t all_cases = 0;
  std::string array_job, collect_job;  ///< Slurm job numbers; "" before submission
};

/// Returns the experiments with their selection, as used by other commands.
ExperimentFiles FilesOf(const ClusterRun& run);

/// Reads and counts all cases. Throws ConfigError as `run`, and if there are fewer cases than parts
/// or an experiment is named twice.
void CountCases(ClusterRun* run);

/// Writes cluster.json if there is none, else returns false. Of several callers one succeeds.
bool MakeClusterRun(const ClusterRun& run, const std::filesystem::path& folder);
void WriteClusterRun(const ClusterRun& run, const std::filesystem::path& folder);
/// Throws ConfigError with file, key, found and expected value if it is missing or invalid.
ClusterRun ReadClusterRun(const std::filesystem::path& folder);

std::filesystem::path PartFolder(const std::filesystem::path& folder, int part);
bool IsDone(const std::filesystem::path& folder, int part);

// Scripts that engines run in the folder of a run in parts.

/// Return the text of a script. `parts`: the parts to run, from 1.
std::string PartScript(const ClusterRun& run, const std::filesystem::path& folder);
std::string ArrayScript(const ClusterRun& run, const std::filesystem::path& folder,
                        const std::vector<int>& parts);
std::string CollectScript(const ClusterRun& run, const std::filesystem::path& folder);

// Progress of the parts, from their stores only.

struct PartProgress {
  int part = 1;
  std::string state;                 ///< done, running, pending, stopped, waiting, ...
  double cases = 0.0;                ///< NaN: not counted
  std::size_t done = 0, failed = 0;  ///< distinct cases, finished and otherwise ended
  double rate = 0.0;                 ///< record rate since the latest start [1/s]; 0: unknown
};

/// Determines progress from the folder only: a part is running if its store is locked, otherwise
/// done, stopped (if it has started) or waiting.
/// @param now  [s] since 1970
PartProgress ProgressOfPart(const ClusterRun& run, const std::filesystem::path& folder, int part,
                            double now);

/// Returns the seconds until all cases are done, from the rates of running parts; NaN if none runs.
double SecondsLeft(const ClusterRun& run, const std::vector<PartProgress>& parts);

}  // namespace loopbench::harness
