#include "harness/cluster/slurm.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <charconv>
#include <sstream>
#include <stdexcept>

#include "harness/text/run_program.h"

namespace loopbench::harness {

std::string SubmitJob(const std::filesystem::path& script,
                      const std::vector<std::string>& options) {
  std::vector<std::string> words = {"sbatch", "--parsable"};
  words.insert(words.end(), options.begin(), options.end());
  words.push_back(script.string());
  const ProgramResult result = RunProgram(std::move(words));
  if (const std::string failure = result.Failure("sbatch"); !failure.empty()) {
    throw std::runtime_error(fmt::format(
        "{}{}", failure,
        result.error == 0 ? ""
                          : "; without Slurm, let another engine call part.sh (docs/clusters.md)"));
  }
  // "12" or "12;cluster"
  return result.output.substr(0, result.output.find_first_of(";\n"));
}

std::optional<std::map<int, std::string>> QueuedTasks(const std::string& job,
                                                      std::string* problem) {
  std::map<int, std::string> tasks;
  if (job.empty()) return tasks;
  const ProgramResult result =
      RunProgram({"squeue", "--noheader", "--array", "--jobs=" + job, "--format=%K %T"});
  const std::string failure = result.Failure("squeue");
  if (result.messages.find("Invalid job id") != std::string::npos) return tasks;
  if (!failure.empty()) {
    *problem = failure;
    return std::nullopt;
  }
  std::istringstream lines(result.output);
  std::string index, state;
  while (lines >> index >> state) {
    int number = 0;
    std::from_chars(index.data(), index.data() + index.size(), number);
    std::ranges::transform(state, state.begin(),
                           [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    if (number > 0) tasks[number] = state;
  }
  return tasks;
}

}  // namespace loopbench::harness
