// Slurm's own commands: sbatch and squeue.
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace loopbench::harness {

/// The number of the job that the script became. Throws std::runtime_error with what sbatch said.
/// @param options  before the script: "--dependency=afterany:12"
std::string SubmitJob(const std::filesystem::path& script, const std::vector<std::string>& options);

/// States of the tasks of an array job that are in the queue, "running", "pending", ... by their
/// index; empty when the job has left it. Nothing when there is no Slurm here, or it does not
/// answer: `problem` then says why.
std::optional<std::map<int, std::string>> QueuedTasks(const std::string& job, std::string* problem);

}  // namespace loopbench::harness
