#include "harness/cluster/cluster_folder.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cmath>
#include <limits>
#include <sstream>

#include "harness/record/provenance.h"
#include "harness/record/record_json.h"
#include "harness/suite/suite.h"
#include "harness/suite/workload.h"
#include "harness/text/config_error.h"
#include "harness/text/escape.h"
#include "harness/text/files.h"

namespace loopbench::harness {
namespace {

constexpr const char* kRunFile = "cluster.json";

std::string Listed(const std::vector<std::string>& texts) {
  return fmt::format("{}", fmt::join(texts, "\n"));
}

std::vector<std::string> Unlisted(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream all(text);
  for (std::string line; std::getline(all, line);) lines.push_back(line);
  return lines;
}

std::vector<std::string> Texts(const std::vector<std::filesystem::path>& paths) {
  std::vector<std::string> texts;
  for (const auto& path : paths) texts.push_back(path.string());
  return texts;
}

const Value& Required(const Record& record, const std::string& key) {
  const Value* value = record.Find(key);
  if (value == nullptr) throw ConfigError(fmt::format("found no \"{}\"", key));
  return *value;
}

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

}  // namespace

ExperimentFiles FilesOf(const ClusterRun& run) {
  ExperimentFiles files;
  files.paths = run.experiments;
  for (const std::string& text : run.settings) files.settings.push_back(ParseSetting(text));
  for (const std::string& text : run.conditions) files.filter.push_back(ParseCondition(text));
  return files;
}

void CountCases(ClusterRun* run) {
  const ExperimentFiles files = FilesOf(*run);
  const Workload workload(files);
  run->name = workload.first().name;
  const auto parts = static_cast<std::size_t>(run->parts);
  std::size_t all = 0, smallest = 0;
  if (!workload.is_long()) {
    run->cases.assign(parts, 0.0);
    for (const Experiment& experiment : workload.some()) {
      for (std::size_t i = SelectCases(experiment, files.filter).size(); i > 0; --i) {
        run->cases[all++ % parts] += 1.0;
      }
    }
    smallest = all;
  } else {
    // where all combinations have as many cases, those of each part are known
    run->cases.assign(parts, std::numeric_limits<double>::quiet_NaN());
    for (const auto& path : files.paths) {
      const Overview overview = MakeOverview(path, files);
      all += overview.cases();
      smallest += overview.combinations;
    }
    if (files.paths.size() == 1 && files.filter.empty() && all % smallest == 0) {
      for (std::size_t k = 0; k < parts; ++k) {
        const std::size_t combinations = smallest / parts + (k < smallest % parts ? 1 : 0);
        run->cases[k] = static_cast<double>(combinations * (all / smallest));
      }
    }
  }
  run->all_cases = static_cast<std::int64_t>(all);
  if (smallest < parts) {
    throw ConfigError(
        fmt::format("--tasks: found {}, expected at most {}, as many as there is to "
                    "run",
                    run->parts, smallest));
  }
}

void WriteClusterRun(const ClusterRun& run, const std::filesystem::path& folder) {
  Record record;
  record.Set("kind", std::string("cluster"));
  record.Set("experiment", run.name);
  record.Set("experiments", Listed(Texts(run.experiments)));
  record.Set("settings", Listed(run.settings));
  record.Set("conditions", Listed(run.conditions));
  record.Set("parts", std::int64_t{run.parts});
  record.Set("jobs", std::int64_t{run.jobs});
  record.Set("with_timing", run.timing);
  record.Set("isolate", run.isolate);
  record.Set("batch_options", Listed(run.batch_options));
  record.Set("program", run.program);
  record.Set("all_cases", run.all_cases);
  record.Set("cases_of_parts", run.cases);
  record.Set("array_job", run.array_job);
  record.Set("collect_job", run.collect_job);
  WriteFileAtomically(folder / kRunFile, ToJsonLine(record) + '\n');
}

ClusterRun ReadClusterRun(const std::filesystem::path& folder) {
  const auto file = folder / kRunFile;
  if (!std::filesystem::exists(file)) {
    throw ConfigError(
        fmt::format("{}: no such file, expected the folder of a loopbench submit", file.string()));
  }
  ClusterRun run;
  try {
    const Record record = FromJsonLine(Unlisted(ReadFile(file)).at(0));
    for (const std::string& path : Unlisted(record.Text("experiments"))) {
      run.experiments.emplace_back(path);
    }
    run.settings = Unlisted(record.Text("settings"));
    run.conditions = Unlisted(record.Text("conditions"));
    run.parts = static_cast<int>(std::get<std::int64_t>(Required(record, "parts")));
    run.jobs = static_cast<int>(std::get<std::int64_t>(Required(record, "jobs")));
    run.timing = std::get<bool>(Required(record, "with_timing"));
    run.isolate = std::get<bool>(Required(record, "isolate"));
    run.batch_options = Unlisted(record.Text("batch_options"));
    run.program = record.Text("program");
    run.name = record.Text("experiment");
    run.all_cases = std::get<std::int64_t>(Required(record, "all_cases"));
    run.cases = std::get<std::vector<double>>(Required(record, "cases_of_parts"));
    run.array_job = record.Text("array_job");
    run.collect_job = record.Text("collect_job");
    if (run.cases.size() != static_cast<std::size_t>(run.parts)) {
      throw ConfigError(fmt::format("\"cases_of_parts\": found {} numbers, expected {}",
                                    run.cases.size(), run.parts));
    }
  } catch (const std::exception& error) {
    throw ConfigError(fmt::format("{}: {}", file.string(), error.what()));
  }
  return run;
}

std::filesystem::path PartFolder(const std::filesystem::path& folder, int part) {
  return folder / "parts" / std::to_string(part);
}

bool IsDone(const std::filesystem::path& folder, int part) {
  return std::filesystem::exists(PartFolder(folder, part) / "done");
}

std::string PartScript(const ClusterRun& run, const std::filesystem::path& folder) {
  return fmt::format(R"(#!/bin/sh
# part.sh K: runs the K-th of {0} parts, or goes on with it where it stopped. Killed, moved to another
# machine, or started twice (the second waits for the first), it loses and repeats nothing.
set -eu
part=${{1:?"expected the number of a part, 1 to {0}"}}
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
             "#SBATCH --array={}\n#SBATCH --requeue\n#SBATCH --cpus-per-task={}\n"
             "#SBATCH --output={}/logs/%a.log\nexec sh {} \"$SLURM_ARRAY_TASK_ID\"\n",
             Ranges(parts), run.jobs, folder.string(), ShellLine({(folder / "part.sh").string()}));
}

std::string CollectScript(const ClusterRun& run, const std::filesystem::path& folder) {
  return BatchHead(run, run.name + "-collect") +
         fmt::format("#SBATCH --output={}/logs/collect.log\nexec {}\n", folder.string(),
                     ShellLine({run.program, "collect", folder.string()}));
}

}  // namespace loopbench::harness
