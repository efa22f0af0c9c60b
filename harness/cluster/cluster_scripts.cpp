#include "harness/cluster/cluster_scripts.h"

#include <fmt/format.h>

#include "harness/record/provenance.h"
#include "harness/text/escape.h"

namespace loopbench::harness {
namespace {

/// The command that runs a part, before --shard.
std::vector<std::string> RunWords(const ClusterRun& run) {
  std::vector<std::string> words = {run.program, "run"};
  for (const auto& path : run.experiments) words.push_back(path.string());
  for (const std::string& text : run.settings) words.insert(words.end(), {"--set", text});
  for (const std::string& text : run.conditions) words.insert(words.end(), {"--filter", text});
  if (!run.timing) words.push_back("--no-timing");
  if (run.isolate) words.push_back("--isolate");
  words.insert(words.end(), {"--jobs", std::to_string(run.jobs), "--wait"});
  return words;
}

/// "1-3,7": as short as an array job takes it.
std::string Ranges(const std::vector<int>& parts) {
  std::string text;
  for (std::size_t i = 0; i < parts.size();) {
    std::size_t last = i;
    while (last + 1 < parts.size() && parts[last + 1] == parts[last] + 1) ++last;
    if (!text.empty()) text += ',';
    text += last == i ? fmt::format("{}", parts[i]) : fmt::format("{}-{}", parts[i], parts[last]);
    i = last + 1;
  }
  return text;
}

std::string BatchHead(const ClusterRun& run, const std::string& name) {
  std::string head =
      fmt::format("#!/bin/sh\n#SBATCH --job-name={}\n#SBATCH --open-mode=append\n", FileName(name));
  for (const std::string& option : run.batch_options) head += "#SBATCH " + option + '\n';
  return head;
}

/// A line that says where a job's output goes. Slurm reads quotes and backslashes as a shell does,
/// and %X as something of the job.
std::string OutputLine(const std::filesystem::path& folder, const std::string& name) {
  std::string quoted;
  for (const char c : folder.string()) {
    if (c == '"' || c == '\\') quoted += '\\';
    if (c == '%') quoted += '%';
    quoted += c;
  }
  return fmt::format("#SBATCH --output=\"{}/logs/{}.log\"\n", quoted, name);
}

}  // namespace

std::string PartScript(const ClusterRun& run, const std::filesystem::path& folder) {
  return fmt::format(R"(#!/bin/sh
# part.sh K: runs the K-th of {0} parts, or goes on with it where it stopped. Killed, moved to another
# machine, or started twice (the second waits for the first), it loses and repeats nothing.
set -eu
part=${{1-}}
case $part in
  '' | 0* | *[!0-9]*) part= ;;
  *) [ "$part" -le {0} ] 2>/dev/null || part= ;;
esac
if [ -z "$part" ]; then
  echo "part.sh: found '${{1-}}', expected the number of a part, 1 to {0}" >&2
  exit 2
fi
cd {1}
mkdir -p "parts/$part"
lines=0
[ ! -f "parts/$part/results.jsonl" ] || lines=$(wc -l <"parts/$part/results.jsonl")
echo "$(date +%s) $lines" >"parts/$part/started"
{2} --shard "$part/{0}" --out "parts/$part"
: >"parts/$part/done"
)",
                     run.parts, ShellLine({folder.string()}), ShellLine(RunWords(run)));
}

std::string ArrayScript(const ClusterRun& run, const std::filesystem::path& folder,
                        const std::vector<int>& parts) {
  return BatchHead(run, run.name) +
         fmt::format(
             "#SBATCH --array={}\n#SBATCH --requeue\n#SBATCH --cpus-per-task={}\n{}"
             "exec sh {} \"$SLURM_ARRAY_TASK_ID\"\n",
             Ranges(parts), run.jobs, OutputLine(folder, "%a"),
             ShellLine({(folder / "part.sh").string()}));
}

std::string CollectScript(const ClusterRun& run, const std::filesystem::path& folder) {
  return BatchHead(run, run.name + "-collect") +
         fmt::format("{}exec {}\n", OutputLine(folder, "collect"),
                     ShellLine({run.program, "collect", folder.string()}));
}

}  // namespace loopbench::harness
