#include "harness/suite/cluster.h"

#include <fmt/ranges.h>

#include <cctype>
#include <cmath>
#include <fstream>
#include <limits>
#include <set>
#include <sstream>

#include "harness/base/record.h"
#include "harness/base/store.h"
#include "harness/base/text.h"
#include "harness/run/run.h"

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
  return Mapped<std::string>(paths, [](const auto& path) { return path.string(); });
}

/// Returns the value as written in the file.
std::string Shown(const Value& value) {
  Record record;
  record.Set("x", value);
  const std::string text = ToJsonObject(record);  // {"x":VALUE}
  constexpr std::size_t kBefore = 5;
  return text.substr(kBefore, text.size() - kBefore - 1);
}

/// Throws ConfigError with the key, the found and the expected value.
template <class T>
const T& Required(const Record& record, const std::string& key, const std::string& expected) {
  const Value* value = record.Find(key);
  if (const T* held = value == nullptr ? nullptr : std::get_if<T>(value)) return *held;
  throw ConfigError(fmt::format("\"{}\": found {}, expected {}", key,
                                value == nullptr ? "nothing" : Shown(*value), expected));
}

const std::string& Text(const Record& record, const std::string& key) {
  return Required<std::string>(record, key, "a text");
}

bool Flag(const Record& record, const std::string& key) {
  return Required<bool>(record, key, "true or false");
}

std::int64_t Whole(const Record& record, const std::string& key, std::int64_t least,
                   std::int64_t most) {
  const std::int64_t number = Required<std::int64_t>(record, key, "a whole number");
  if (number >= least && number <= most) return number;
  throw ConfigError(fmt::format("\"{}\": found {}, expected {} to {}", key, number, least, most));
}

Record ToRecord(const ClusterRun& run) {
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
  return record;
}

ClusterRun ToClusterRun(const Record& record) {
  ClusterRun run;
  run.name = Text(record, "experiment");
  for (const std::string& path : Unlisted(Text(record, "experiments"))) {
    run.experiments.emplace_back(path);
  }
  run.settings = Unlisted(Text(record, "settings"));
  run.conditions = Unlisted(Text(record, "conditions"));
  run.parts = static_cast<int>(Whole(record, "parts", 1, kMaxParts));
  run.jobs = static_cast<int>(Whole(record, "jobs", 1, kMaxJobs));
  run.timing = Flag(record, "with_timing");
  run.isolate = Flag(record, "isolate");
  run.batch_options = Unlisted(Text(record, "batch_options"));
  run.program = Text(record, "program");
  run.all_cases = Whole(record, "all_cases", 0, std::numeric_limits<std::int64_t>::max());
  run.cases = Required<std::vector<double>>(record, "cases_of_parts", "numbers");
  run.array_job = Text(record, "array_job");
  run.collect_job = Text(record, "collect_job");
  if (run.cases.size() != static_cast<std::size_t>(run.parts)) {
    throw ConfigError(fmt::format("\"cases_of_parts\": found {} numbers, expected {}",
                                  run.cases.size(), run.parts));
  }
  return run;
}

/// Returns the command that runs a part, without --shard.
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

/// Returns "1-3,7": the shortest form for an array job.
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

/// Returns the line of a job's output file. Slurm interprets quotes, backslashes and %X.
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
  const std::string job = result.output.substr(0, result.output.find_first_of(";\n"));
  if (!job.empty() && job.find_first_not_of("0123456789") == job.npos) return job;
  throw std::runtime_error(
      fmt::format("sbatch: found \"{}\", expected a job number", Excerpt(job)));
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

ExperimentFiles FilesOf(const ClusterRun& run) {
  ExperimentFiles files;
  files.paths = run.experiments;
  for (const std::string& text : run.settings) files.settings.push_back(ParseSetting(text));
  for (const std::string& text : run.conditions) files.filter.push_back(ParseCondition(text));
  return files;
}

void CountCases(ClusterRun* run) {
  std::set<std::filesystem::path> named;
  for (const auto& path : run->experiments) {
    if (named.insert(std::filesystem::weakly_canonical(path)).second) continue;
    throw ConfigError(fmt::format("{}: found twice, expected each experiment once", path.string()));
  }
  const ExperimentFiles files = FilesOf(*run);
  const Workload workload(files);
  run->name = workload.first().name;
  const auto parts = static_cast<std::size_t>(run->parts);
  std::size_t all = 0, smallest = 0;
  if (!workload.is_long()) {
    run->cases.assign(parts, 0.0);
    std::set<std::string> ids;  // a case of two files counts once
    for (const Experiment& experiment : workload.some()) {
      for (const Case& entry : SelectCases(experiment, files.filter)) {
        if (!ids.insert(RunId(Identified(experiment, entry).keys)).second) continue;
        run->cases[all++ % parts] += 1.0;
      }
    }
    smallest = all;
  } else {
    // if all combinations have the same number of cases, the numbers of all parts are known
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

bool MakeClusterRun(const ClusterRun& run, const std::filesystem::path& folder) {
  return WriteNewFile(folder / kRunFile, ToJsonLine(ToRecord(run)) + '\n');
}

void WriteClusterRun(const ClusterRun& run, const std::filesystem::path& folder) {
  OutputFile file(folder / kRunFile, Onto::kAnyFile);
  file.Write(ToJsonLine(ToRecord(run)) + '\n');
  file.Finish();
}

ClusterRun ReadClusterRun(const std::filesystem::path& folder) {
  const auto file = folder / kRunFile;
  if (!std::filesystem::exists(file)) {
    throw ConfigError(
        fmt::format("{}: no such file, expected the folder of a loopbench submit", file.string()));
  }
  try {
    const std::vector<std::string> lines = Unlisted(ReadFile(file));
    if (lines.empty()) {
      throw ConfigError(fmt::format(
          "found an empty file, which a submit that was killed leaves, expected what loopbench "
          "submit writes; submit once more, without --resubmit, after: {}",
          ShellLine({"rm", file.string()})));
    }
    return ToClusterRun(FromJsonLine(lines.front()));
  } catch (const std::exception& error) {
    throw ConfigError(fmt::format("{}: {}", file.string(), error.what()));
  }
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

PartProgress ProgressOfPart(const ClusterRun& run, const std::filesystem::path& folder, int part,
                            double now) {
  PartProgress progress;
  progress.part = part;
  progress.cases = run.cases[part - 1];
  const auto store = PartFolder(folder, part);
  std::unordered_map<std::string, bool> finished;
  std::size_t lines = 0;
  std::ifstream file(store / "results.jsonl", std::ios::binary);
  for (std::string line; std::getline(file, line);) {
    if (file.eof()) break;  // no line end: it is being written
    ++lines;
    if (TextUnder("\"kind\":\"", line) != "accuracy") continue;
    finished[std::string(TextUnder("\"id\":\"", line))] =
        TextUnder("\"outcome\":\"", line) == "finished";
  }
  for (const auto& [id, is_finished] : finished) ++(is_finished ? progress.done : progress.failed);
  std::ifstream began(store / "started");
  double start = 0.0;
  std::size_t lines_then = 0;
  const bool has_begun = static_cast<bool>(began >> start >> lines_then);
  progress.state = IsDone(folder, part)                ? "done"
                   : !has_begun                        ? "waiting"
                   : IsLocked(store / "results.jsonl") ? "running"
                                                       : "stopped";
  if (has_begun && now > start && lines > lines_then) {
    progress.rate = static_cast<double>(lines - lines_then) / (now - start);
  }
  return progress;
}

double SecondsLeft(const ClusterRun& run, const std::vector<PartProgress>& parts) {
  double left = static_cast<double>(run.all_cases), rate = 0.0, longest = 0.0;
  for (const PartProgress& part : parts) {
    const auto there = static_cast<double>(part.done + part.failed);
    left -= there;
    if (part.state != "running" || part.rate == 0.0) continue;
    rate += part.rate;
    if (std::isfinite(part.cases)) longest = std::max(longest, (part.cases - there) / part.rate);
  }
  if (left <= 0.0) return 0.0;
  return rate > 0.0 ? std::max(longest, left / rate) : std::numeric_limits<double>::quiet_NaN();
}

}  // namespace loopbench::harness
