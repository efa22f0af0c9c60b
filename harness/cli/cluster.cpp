// submit, status and collect: a run divided into parts.
#include "harness/suite/cluster.h"

#include <fmt/chrono.h>
#include <fmt/ranges.h>

#include "harness/cli/commands.h"
#include "harness/run/run.h"

namespace loopbench::harness {
namespace {

struct SubmitCommand {
  ClusterRun run;
  std::filesystem::path folder;
  bool again = false, no_queue = false, dry_run = false, no_timing = false;
  std::string time, partition;

  std::vector<Option> Options() {
    return {
        {"experiment", "Experiment files (JSON)", &run.experiments, kExists},
        {"-o,--out", "New folder on a file system that all machines share", &folder, kRequired},
        {"--tasks", "Number of parts, one array task each", &run.parts, From(1, kMaxParts),
         ShowsDefault(false)},
        {"-j,--jobs", "Cases in parallel per part, and processors of its task", &run.jobs,
         From(1, kMaxJobs)},
        {"--time", "Time limit of a part, in the format of sbatch", &time},
        {"--partition", "Slurm partition", &partition},
        {"--sbatch", "Further option of sbatch: --sbatch=--account=mine (repeatable)",
         &run.batch_options},
        {"--filter", "Only cases with key=value[,value] (or !=, <, <=, >, >=)", &run.conditions},
        {"--set", "Set a field before reading: /json/pointer=value", &run.settings},
        {"--no-timing", "Skip timings: parts on one machine disturb each other", &no_timing},
        {"--isolate", "Run each case in its own process", &run.isolate},
        {"--resubmit", "Submit only incomplete parts of this folder", &again},
        {"--no-queue", "Write the folder without submitting", &no_queue},
        {"--dry-run", "Print the scripts without writing", &dry_run}};
  }
};

Option FolderArgument(std::filesystem::path* folder) {
  return {"folder", "Folder created by submit", folder, kRequired};
}

struct CollectCommand {
  std::filesystem::path folder;

  std::vector<Option> Options() { return {FolderArgument(&folder)}; }
};

struct StatusCommand {
  std::filesystem::path folder;
  bool json = false;

  std::vector<Option> Options() {
    return {FolderArgument(&folder), JsonOption(&json), WideOption()};
  }
};

std::vector<int> PartsNotDone(const ClusterRun& run, const std::filesystem::path& folder) {
  std::vector<int> parts;
  for (int part = 1; part <= run.parts; ++part) {
    if (!IsDone(folder, part)) parts.push_back(part);
  }
  return parts;
}

/// Returns the file that exists once all parts are merged.
std::filesystem::path WholeFile(const std::filesystem::path& folder) {
  return StoreFile(folder / "whole");
}

std::string SubmitAgainLine(const std::filesystem::path& folder) {
  return ShellLine({"loopbench", "submit", "--resubmit", "--out", folder.string()});
}

void Queue(const std::vector<int>& parts, const std::filesystem::path& folder, ClusterRun* run) {
  WriteFileAtomically(folder / "array.sh", ArrayScript(*run, folder, parts));
  run->array_job = SubmitJob(folder / "array.sh", {});
  WriteClusterRun(*run, folder);
  run->collect_job = SubmitJob(folder / "collect.sh", {"--dependency=afterany:" + run->array_job});
  WriteClusterRun(*run, folder);
  Print("submitted {} of {} parts as job {}, and the merge behind them as job {}\n", parts.size(),
        run->parts, run->array_job, run->collect_job);
  Print("  {}\n", ShellLine({"loopbench", "status", folder.string()}));
}

/// Writes missing scripts only: the user may have adapted existing ones to the machines.
void WriteScripts(const ClusterRun& run, const std::filesystem::path& folder) {
  MakeFolderOf(folder / "logs" / "x");
  WriteNewFile(folder / "part.sh", PartScript(run, folder));
  WriteNewFile(folder / "collect.sh", CollectScript(run, folder));
}

void PrintHowToRun(const std::filesystem::path& folder) {
  Print("each part: {}; then: {}\n", ShellLine({"sh", (folder / "part.sh").string(), "K"}),
        ShellLine({"loopbench", "collect", folder.string()}));
}

int SubmitAgain(const SubmitCommand& command) {
  ClusterRun run = ReadClusterRun(command.folder);
  std::vector<int> parts = PartsNotDone(run, command.folder);
  if (!command.dry_run) WriteScripts(run, command.folder);
  if (command.no_queue) {
    Print("{}: {}\n", command.folder.string(),
          parts.empty() ? "every part is done"
                        : fmt::format("{} of {} parts are not done: {}", parts.size(), run.parts,
                                      fmt::join(parts, ", ")));
    PrintHowToRun(command.folder);
    return 0;
  }
  std::string problem;
  const auto queued = QueuedTasks(run.array_job, &problem);
  if (!queued) throw std::runtime_error("the state of the parts is not available: " + problem);
  std::erase_if(parts, [&queued](int part) { return queued->contains(part); });
  if (parts.empty()) {
    Print("{}: every part is done or in the queue\n", command.folder.string());
    return 0;
  }
  if (command.dry_run) {
    PrintText(ArrayScript(run, command.folder, parts));
    return 0;
  }
  // the merge depends on one array: remaining parts of the last one must end first
  if (!queued->empty()) {
    Reject<std::runtime_error>(
        "{}: {} parts are still in the queue as job {}; wait for them, or scancel them first",
        command.folder.string(), queued->size(), run.array_job);
  }
  Queue(parts, command.folder, &run);
  return 0;
}

double Now() {
  return std::chrono::duration<double>(std::chrono::system_clock::now().time_since_epoch()).count();
}

/// Returns all parts as one; its state counts theirs.
PartProgress SumOf(const ClusterRun& run, const std::vector<PartProgress>& parts) {
  PartProgress all;
  all.cases = static_cast<double>(run.all_cases);
  std::map<std::string, int> states;
  for (const PartProgress& part : parts) {
    ++states[part.state];
    all.done += part.done;
    all.failed += part.failed;
  }
  all.state = Joined(states, ", ", [](const auto& state) {
    return fmt::format("{} {}", state.second, state.first);
  });
  return all;
}

Table StatusTable(const ClusterRun& run, const std::vector<PartProgress>& parts) {
  Table table{.title = fmt::format("{} in {} parts", run.name, run.parts),
              .columns = Columns(
                  "part, state, cases:integer, done:integer, failed:integer, to_do=to do:integer")};
  const auto add = [&table](const std::string& name, const PartProgress& part) {
    const auto number = [](double value) {
      return std::isfinite(value) ? Value(static_cast<std::int64_t>(value)) : Value();
    };
    AddRow({name, part.state, number(part.cases), part.done, part.failed,
            number(part.cases - static_cast<double>(part.done + part.failed))},
           &table);
  };
  for (const PartProgress& part : parts) add(std::to_string(part.part), part);
  add("all", SumOf(run, parts));
  return table;
}

JsonObject StatusDocument(const ClusterRun& run, const std::vector<PartProgress>& parts,
                          double seconds_left) {
  std::vector<JsonObject> rows = Mapped<JsonObject>(parts, [](const PartProgress& part) {
    return JsonOf("part", part.part, "state", part.state, "cases", part.cases, "done", part.done,
                  "failed", part.failed);
  });
  const PartProgress all = SumOf(run, parts);
  return JsonOf("name", run.name, "cases", run.all_cases, "done", all.done, "failed", all.failed,
                "to_do", run.all_cases - static_cast<std::int64_t>(all.done + all.failed),
                "running_parts", std::ranges::count(parts, "running", &PartProgress::state),
                "array_job", run.array_job, "collect_job", run.collect_job, "seconds_left",
                seconds_left, "parts", rows);
}

/// Checks that the options go together and that no text has a line end: Slurm reads its options
/// from comment lines of the script.
void RequireOptions(const SubmitCommand& command, const Typed& typed) {
  const ClusterRun& run = command.run;
  if (command.again != run.experiments.empty()) {
    throw ConfigError(command.again
                          ? "--resubmit: found experiments beside it, expected none: the folder "
                            "contains them"
                          : "submit: found no experiment, expected at least one, or --resubmit");
  }
  for (const std::string& option : typed.given) {
    if (!command.again ||
        Contains(std::array{"--resubmit", "--out", "--no-queue", "--dry-run"}, option)) {
      continue;
    }
    Reject("--resubmit: found {} beside it, expected none: the folder contains the options",
           option);
  }
  for (const std::string& option : run.batch_options) {
    if (option.starts_with("--")) continue;
    throw ConfigError("--sbatch: found '" + option + "', expected an option that begins with --");
  }
  std::vector<std::string> experiments;
  for (const auto& path : run.experiments) experiments.push_back(path.string());
  for (const auto& [option, texts] : {std::pair{"--out", std::vector{command.folder.string()}},
                                      {"experiment", experiments},
                                      {"--set", run.settings},
                                      {"--filter", run.conditions},
                                      {"--time, --partition or --sbatch", run.batch_options}}) {
    for (const std::string& text : texts) {
      if (text.find_first_of("\n\r") == std::string::npos) continue;
      Reject("{}: found a line end in '{}', expected a text of one line", option, text);
    }
  }
}

int Submit(SubmitCommand& command, const Typed& typed) {
  auto& [run, folder, again, no_queue, dry_run, no_timing, time, partition] = command;
  if (!time.empty()) run.batch_options.push_back("--time=" + time);
  if (!partition.empty()) run.batch_options.push_back("--partition=" + partition);
  run.timing = !no_timing;
  folder = std::filesystem::absolute(folder).lexically_normal();
  if (!folder.has_filename()) folder = folder.parent_path();
  RequireOptions(command, typed);
  if (again) return SubmitAgain(command);
  for (auto& path : run.experiments) path = std::filesystem::absolute(path).lexically_normal();
  run.program = std::filesystem::read_symlink("/proc/self/exe").string();
  CountCases(&run);
  std::vector<int> parts;
  for (int part = 1; part <= run.parts; ++part) parts.push_back(part);
  if (dry_run) {
    for (const auto& [name, text] : {std::pair{"part.sh", PartScript(run, folder)},
                                     {"array.sh", ArrayScript(run, folder, parts)},
                                     {"collect.sh", CollectScript(run, folder)}}) {
      PrintText(fmt::format("==> {} <==\n{}\n", (folder / name).string(), text));
    }
    Print("{} in {}; nothing was written, nothing submitted\n", WithCount(run.all_cases, "case"),
          WithCount(run.parts, "part"));
    return 0;
  }
  if (!MakeClusterRun(run, folder)) {
    Reject("{}: found the folder of a submit, expected a new one; to resume it: {}",
           folder.string(), SubmitAgainLine(folder));
  }
  WriteScripts(run, folder);
  Print("{} in {} in {}\n", WithCount(run.all_cases, "case"), WithCount(run.parts, "part"),
        folder.string());
  no_queue ? PrintHowToRun(folder) : Queue(parts, folder, &run);
  return 0;
}

int PrintStatus(const StatusCommand& command, const Typed&) {
  const std::filesystem::path& folder = command.folder;
  const ClusterRun run = ReadClusterRun(folder);
  std::string problem;
  const auto queued = QueuedTasks(run.array_job, &problem);
  std::vector<PartProgress> parts;
  for (int part = 1; part <= run.parts; ++part) {
    parts.push_back(ProgressOfPart(run, folder, part, Now()));
    PartProgress& progress = parts.back();
    // a completed part is done, even if jobs for it are still queued
    if (progress.state == "done" || !queued) continue;
    if (const auto task = queued->find(part); task != queued->end()) progress.state = task->second;
  }
  const double left = SecondsLeft(run, parts);
  if (command.json) return PrintJson(StatusDocument(run, parts, left));
  Table table = StatusTable(run, parts);
  if (!problem.empty()) table.notes.push_back("states from the stores alone: " + problem);
  const auto whole = WholeFile(folder);
  const bool is_whole = HasRecords(whole);
  if (is_whole) {
    AddNote(table.notes, "merged: {}", whole.parent_path().string());
  } else if (IsLocked(UnderWay(whole))) {
    table.notes.push_back("the parts are being merged");
  } else if (left > 0.0) {
    AddNote(table.notes, "about {:.0f} s left, until {:%H:%M}", left,
            fmt::localtime(static_cast<std::time_t>(Now() + left)));
  }
  const bool is_stuck =
      !is_whole && queued && queued->empty() && !PartsNotDone(run, folder).empty();
  if (is_stuck && !run.array_job.empty()) {
    AddNote(table.notes, "no part is queued; the others go on with {}", SubmitAgainLine(folder));
  }
  PrintText(ToScreen(table) + "\n");
  return 0;
}

/// Merges all parts into folder/whole in the order of the experiments and returns 0. Returns 1 and
/// writes nothing if a case is missing.
int Collect(const CollectCommand& command, const Typed&) {
  const std::filesystem::path& folder = command.folder;
  const ClusterRun run = ReadClusterRun(folder);
  if (const std::vector<int> open = PartsNotDone(run, folder); !open.empty()) {
    PrintError("{}: {} of {} parts are not done: {}; nothing was merged\n", folder.string(),
               open.size(), run.parts, fmt::join(open, ", "));
    return 1;
  }
  if (HasRecords(WholeFile(folder))) {
    Print("{} is there already\n", WholeFile(folder).parent_path().string());
    return 0;
  }
  MergeCommand merge;
  merge.out = WholeFile(folder).parent_path();
  const ExperimentFiles files = FilesOf(run);
  Workload workload(files);
  std::set<std::string> known;  // a case in two files counts once
  for (std::size_t group = 0; group < workload.groups(); ++group) {
    for (const Experiment& experiment : workload.Read(group).experiments) {
      for (const Case& one : SelectCases(experiment, files.filter)) {
        const std::string id = RunId(Identified(experiment, one).keys);
        if (known.insert(id).second) merge.order.push_back(id);
      }
    }
  }
  for (int part = 1; part <= run.parts; ++part) merge.stores.push_back(PartFolder(folder, part));
  return Merge(merge);
}

}  // namespace

void AddCluster(Commands& commands) {
  commands.Add("submit", "Run experiments in parts on a cluster (Slurm)", Submit);
  commands.Add("status", "Show the progress of a submitted run", PrintStatus);
  commands.Add("collect", "Merge the parts of a submitted run", Collect);
}

}  // namespace loopbench::harness
