// run and merge: experiments into a store, stores into one.
#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <iterator>
#include <map>
#include <set>

#include "harness/analysis/warnings.h"
#include "harness/cli/command_line.h"
#include "harness/cli/commands.h"
#include "harness/isolation/processes.h"
#include "harness/judge/claims.h"
#include "harness/reference/reference.h"
#include "harness/run/peers.h"
#include "harness/run/run_case.h"
#include "harness/store/record_lines.h"
#include "harness/store/result_store.h"
#include "harness/store/store_lock.h"
#include "harness/suite/reference_cases.h"
#include "harness/suite/suite.h"
#include "harness/text/files.h"
#include "harness/text/terminal.h"
#include "harness/trajectory/trajectory.h"

namespace loopbench::harness {
namespace {

std::size_t CountLines(const std::filesystem::path& file) {
  std::ifstream lines(file, std::ios::binary);
  return static_cast<std::size_t>(
      std::count(std::istreambuf_iterator<char>(lines), std::istreambuf_iterator<char>(), '\n'));
}

/// Returns the records of `ids`, in order; other records of the store are ignored.
std::vector<Record> RecordsOf(const std::vector<std::string>& ids,
                              const std::vector<Record>& records) {
  std::map<std::string, const Record*> last;
  for (const Record& record : records) last[record.Text("id")] = &record;
  std::vector<Record> asked;
  for (const std::string& id : ids) asked.push_back(*last.at(id));
  return WithContents(std::move(asked));
}

void PrintInterrupted(const RunCommand& command, const ResultStore& store) {
  PrintError(
      "interrupted: {} records are kept in {}, {} of them of this run; cases under way were "
      "stopped "
      "and left nothing, tables were not written\n",
      CountLines(store.file()), store.file().string(), store.appended());
  if (command.suite.rerun == Rerun::kAll) {
    PrintError("to go on, without those that were run again: the same command with --rerun none\n");
  } else {
    PrintError("to go on: {}\n", command.again);
  }
}

}  // namespace

int RunExperiments(const RunCommand& command, const std::string& typed) {
  // read everything first: a mistake in the last file must not cost the runs of the first
  Workload workload({command.experiments, command.settings, command.suite.filter, command.threads},
                    command.suite.shard);
  if (workload.is_long() && !command.gate.empty()) {
    throw ConfigError(fmt::format(
        "--fail-on {}: found a sweep of more than {} combinations, whose records are not held at "
        "once; judge parts of it: loopbench table STORE --where ... --fail-on {}",
        command.gate, kLongSweep, command.gate));
  }
  RequirePeers(workload.some());
  if (command.suite.precision) {
    for (const Experiment& experiment : workload.some()) RequireLadders(experiment);
  }
  if (command.suite.accuracy) {
    for (const Experiment& experiment : workload.some()) RequireReferences(experiment);
  }
  const std::filesystem::path out =
      command.out.empty() ? std::filesystem::path("results/runs") / FileName(workload.first().name)
                          : command.out;
  SuiteCount count;
  {
    ResultStore store(out, command.wait);
    FinishedRuns finished(out);
    try {
      count = RunSuite(workload, command.suite, finished, store);
    } catch (const Interrupted& interrupted) {
      PrintInterrupted(command, store);
      return interrupted.exit_code();
    }
    PrintError(
        "ran {}{}{}, {} reused\n", WithCount(count.run, "case"),
        count.failed > 0 ? fmt::format(" ({} not finished)", count.failed) : "",
        count.processes < count.pieces ? fmt::format(" in {} processes", count.processes) : "",
        count.skipped);
  }
  if (workload.is_long()) {
    Print(
        "results in {}\nNo tables were written: a long sweep's are chosen from it, as by\n"
        "  loopbench table {} --where mechanism={}\n",
        out.string(), out.string(), workload.first().problems.front().name);
    return 0;
  }
  std::vector<Record> records = RecordsOf(count.ids, ReadRecords(out));
  SetWarnings(&records);
  WriteTables(records, out, typed);
  Print("results in {}\n", out.string());
  return command.gate.empty() ? 0 : WarningGate(records);
}

int Merge(const MergeCommand& command) {
  NewStore target(command.out);
  const MergedStores merged(command.stores, command.order);
  if (!merged.missing().empty()) {
    PrintError(
        "{}: {} of {} cases are in no part, {} among them; nothing was merged. The experiment, its "
        "mechanisms or the program are not what they were when the parts ran\n",
        target.file().string(), merged.missing().size(), command.order.size(),
        merged.missing().front());
    return 1;
  }
  std::vector<std::filesystem::path> files;
  for (const auto& store : command.stores) files.push_back(StoreFile(store));
  // partial references next to the future store are one more part
  std::vector<std::filesystem::path> with_target = files;
  with_target.push_back(target.file());
  const MergedReferences references = MergeReferences(with_target);
  std::set<std::string> problems;
  for (std::size_t i = 0; i < merged.size(); ++i) {
    const Record record = merged[i];
    std::vector<std::filesystem::path> owners;
    for (const auto& store : merged.StoresOf(i)) owners.push_back(StoreFile(store));
    for (const std::string& name : CopyTrajectories({record}, owners, target.file())) {
      PrintError("warning: no store has trajectories/{} as the run that is kept wrote it\n", name);
    }
    if (problems.insert(record.Text("problem_id")).second) {
      CopyMechanisms({record}, files, target.file());
    }
    target.Append(record);
  }
  WriteReferences(references, target.file());
  target.Commit();
  for (const std::string& note : references.notes) PrintError("{}\n", note);
  Print("{} records of {} stores are {} cases in {}\n", merged.read(), command.stores.size(),
        merged.size(), target.file().string());
  if (!references.texts.empty()) {
    Print("{} references beside it\n", references.texts.size());
  }
  return 0;
}

namespace {

struct RunOptions {
  RunCommand command;
  std::vector<std::string> conditions, settings;  ///< --filter and --set, as typed
  std::string shard = "1/1", rerun = "none";
  bool no_timing = false, timing_only = false, precision_only = false;
};

int RunAsTyped(RunOptions& options, const Typed& typed) {
  RunCommand& command = options.command;
  command.settings = ParseSettings(options.settings);
  command.suite.filter = ParseSelection(options.conditions);
  command.again = typed.again;
  command.suite.timing = !options.no_timing && !options.precision_only;
  command.suite.accuracy = !options.timing_only && !options.precision_only;
  command.suite.precision = !options.timing_only;
  command.suite.set = fmt::format("{}", fmt::join(options.settings, " "));
  command.suite.shard = ParseShard(options.shard);
  command.suite.rerun = options.rerun == "all"      ? Rerun::kAll
                        : options.rerun == "failed" ? Rerun::kFailed
                                                    : Rerun::kNone;
  return RunExperiments(command, typed.line);
}

}  // namespace

void AddRun(Commands& commands) {
  auto& options = commands.Keep<RunOptions>();
  RunCommand& command = options.command;
  CLI::App* app =
      commands.Add("run", "Run experiments (resumes an interrupted run) and write results",
                   [&](const Typed& typed) { return RunAsTyped(options, typed); });
  app->add_option("experiment", command.experiments, "Experiment files (JSON)")->required();
  app->add_option("-o,--out", command.out,
                  "Folder for results.jsonl, drift.csv and timing.csv "
                  "(default: results/runs/NAME)");
  app->add_option("-j,--jobs", command.suite.jobs,
                  "Accuracy cases to run in parallel; timings run alone")
      ->check(NumberFrom(1, 1024))
      ->capture_default_str();
  app->add_option("--threads", command.threads,
                  "Threads per right-hand side (O-DCA on long chains); same results")
      ->check(NumberFrom(1, kMaxThreads));
  AddFilter(app, &options.conditions);
  AddSettings(app, &options.settings);
  AddWide(app);
  app->add_option("--shard", options.shard, "Run part K of N; merge joins the parts")
      ->capture_default_str();
  app->add_flag("--isolate", command.suite.isolate,
                "Run each case in its own process; otherwise short cases share processes");
  app->add_flag("--wait", command.wait,
                "Wait while another process writes to the store, then continue");
  AddChoice(app, "--rerun", &options.rerun, "Stored cases to run again", {"none", "failed", "all"});
  CLI::Option* gate = AddGate(app, &command.gate);
  CLI::Option* no = app->add_flag("--no-timing", options.no_timing, "Skip timings");
  CLI::Option* timings =
      app->add_flag("--timing-only", options.timing_only, "Run timings only")->excludes(no);
  timings->excludes(gate);  // the gate judges accuracy runs
  app->add_flag("--precision-only", options.precision_only,
                "Run only precision studies (several floating-point types)")
      ->excludes(no)
      ->excludes(timings)
      ->excludes(gate);
}

void AddMerge(Commands& commands) {
  auto& command = commands.Keep<MergeCommand>();
  CLI::App* app = commands.Add("merge", "Join the stores of shards",
                               [&](const Typed&) { return Merge(command); });
  app->add_option("store", command.stores, "Folders of runs, or .jsonl files")->required();
  app->add_option("-o,--out", command.out, "Folder of the new store")->required();
}

}  // namespace loopbench::harness
