#include "harness/cluster/cluster_folder.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cmath>
#include <limits>
#include <set>
#include <sstream>

#include "harness/record/provenance.h"
#include "harness/record/record_json.h"
#include "harness/run/case_identity.h"
#include "harness/suite/suite.h"
#include "harness/suite/workload.h"
#include "harness/text/config_error.h"
#include "harness/text/files.h"
#include "harness/text/output_file.h"

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

/// The value as it stands in the file.
std::string Shown(const Value& value) {
  Record record;
  record.Set("x", value);
  const std::string text = ToJsonObject(record);  // {"x":VALUE}
  constexpr std::size_t kBefore = 5;
  return text.substr(kBefore, text.size() - kBefore - 1);
}

/// Throws ConfigError that says the key, and what was found and expected.
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
  run.parts = static_cast<int>(Whole(record, "parts", 1, kMostParts));
  run.jobs = static_cast<int>(Whole(record, "jobs", 1, kMostJobs));
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

}  // namespace

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
    std::set<std::string> ids;  // a case that two files share is one case
    for (const Experiment& experiment : workload.some()) {
      for (const Case& one : SelectCases(experiment, files.filter)) {
        if (!ids.insert(RunId(Identified(experiment, one).keys)).second) continue;
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
          "submit writes; submit once more, without --again, after: {}",
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

}  // namespace loopbench::harness
