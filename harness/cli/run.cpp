// run, merge and estimate: experiments into a store, stores into one, and the time before.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <functional>
#include <iterator>
#include <map>
#include <set>
#include <utility>

#include "harness/analysis/warnings.h"
#include "harness/cli/command_line.h"
#include "harness/cli/commands.h"
#include "harness/isolation/processes.h"
#include "harness/judge/claims.h"
#include "harness/record/record.h"
#include "harness/reference/reference.h"
#include "harness/run/case_identity.h"
#include "harness/run/peers.h"
#include "harness/run/run_case.h"
#include "harness/store/record_lines.h"
#include "harness/store/result_store.h"
#include "harness/store/store_lock.h"
#include "harness/suite/estimate.h"
#include "harness/suite/reference_cases.h"
#include "harness/suite/runner.h"
#include "harness/suite/suite.h"
#include "harness/suite/workload.h"
#include "harness/tables/fit.h"
#include "harness/text/cpu_time.h"
#include "harness/text/files.h"
#include "harness/text/terminal.h"
#include "harness/text/words.h"
#include "harness/timing/time_cases.h"
#include "harness/trajectory/trajectory.h"

namespace loopbench::harness {
namespace {

struct RunCommand {
  std::vector<std::filesystem::path> experiments;
  std::filesystem::path out;  ///< folder; default results/runs/<name of the first experiment>
  std::vector<Setting> settings;
  SuiteOptions suite;
  int threads = 0;    ///< as in ExperimentFiles
  std::string gate;   ///< "warnings" or ""
  bool wait = false;  ///< wait while another process writes to the store
  std::string again;  ///< the command in shell syntax, printed as the command to resume
};

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

/// Runs the cases that the store lacks, then writes its tables. If interrupted, prints the number
/// of kept results and returns 128 + the signal number: 130 for Ctrl-C.
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
  RequireFreedom(workload.some());
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

}  // namespace

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
  std::vector<std::string> settings;  ///< --set, as typed
  std::string shard = "1/1", rerun = "none";
  bool no_timing = false, timing_only = false, precision_only = false;
};

int RunAsTyped(RunOptions& options, const Typed& typed) {
  RunCommand& command = options.command;
  for (const std::string& text : options.settings) {
    command.settings.push_back(ParseSetting(text));
  }
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
  SuiteOptions& suite = command.suite;
  commands.Add(
      "run", "Run experiments (resumes an interrupted run) and write results",
      [&](const Typed& typed) { return RunAsTyped(options, typed); },
      {{"experiment", "Experiment files (JSON)", &command.experiments, kRequired},
       {"-o,--out",
        "Folder for results.jsonl, drift.csv and timing.csv (default: results/runs/NAME)",
        &command.out},
       {"-j,--jobs", "Accuracy cases to run in parallel; timings run alone", &suite.jobs,
        From(1, 1024)},
       {"--threads", "Threads per right-hand side (O-DCA on long chains); same results",
        &command.threads, From(1, kMaxThreads)},
       FilterOption(&suite.filter),
       {"--set", "Change a field of the file: /json/pointer=value", &options.settings},
       WideOption(),
       {"--shard", "Run part K of N; merge joins the parts", &options.shard},
       {"--isolate", "Run each case in its own process; otherwise short cases share processes",
        &suite.isolate},
       {"--wait", "Wait while another process writes to the store, then continue", &command.wait},
       {"--rerun", "Stored cases to run again", &options.rerun, OneOf({"none", "failed", "all"})},
       GateOption(&command.gate),
       {"--no-timing", "Skip timings", &options.no_timing},
       // the gate judges accuracy runs

       {"--timing-only", "Run timings only", &options.timing_only,
        Excludes({"--no-timing", "--fail-on"})},
       {"--precision-only", "Run only precision studies (several floating-point types)",
        &options.precision_only, Excludes({"--no-timing", "--timing-only", "--fail-on"})}});
}

void AddMerge(Commands& commands) {
  auto& command = commands.Keep<MergeCommand>();
  commands.Add("merge", "Join the stores of shards", [&](const Typed&) { return Merge(command); },
               {{"store", "Folders of runs, or .jsonl files", &command.stores, kRequired},
                {"-o,--out", "Folder of the new store", &command.out, kRequired}});
}

namespace {

struct PlanCommand {
  ExperimentFiles files;
  std::filesystem::path from;  ///< store of earlier results, used for times of the cases in it
  bool no_timing = false;      ///< skip timings
  bool json = false;
};

/// Key of all that decides a run except the experiment's name: results of another file with the
/// same cases are used too.
std::string SameRun(const Record& record) {
  std::string text = record.Text("config_hash") + "\n";
  for (const auto& [key, value] : record.items()) {
    if (key == "case_id") break;
    if (key != "experiment") text += key + "=" + record.Text(key) + "\n";
  }
  return text;
}

/// Returns CPU time [s] of the unperturbed run by SameRun(), from an earlier store.
std::map<std::string, double> EarlierTimes(const std::filesystem::path& store) {
  std::map<std::string, double> times;
  if (store.empty()) return times;
  for (const Record& record : ReadRecords(store)) {
    // wall time depends on how many runs shared the processors
    if (record.Text("kind") != "accuracy" || std::isnan(record.Number("cpu_s"))) continue;
    times[SameRun(record)] = record.Number("cpu_s");
  }
  return times;
}

/// Returns "1.5 s", "12 min", "3.4 h".
std::string Duration(double seconds) {
  if (seconds < 0.1) return "less than 0.1 s";
  if (seconds < 100.0) return fmt::format("{:.2g} s", seconds);
  if (seconds < 6000.0) return fmt::format("{:.0f} min", seconds / 60.0);
  return fmt::format("{:.1f} h", seconds / 3600.0);
}

/// Line of the plan: the cases of a problem and method, over all combinations.
struct Line : CaseLine {
  double seconds = 0.0;
};

struct Plan {
  std::vector<Line> lines;
  std::size_t cases = 0, runs = 0, references = 0, rungs = 0, timings = 0, known = 0;
  double seconds = 0.0, reference_seconds = 0.0, ladder_seconds = 0.0, timing_seconds = 0.0;
};

/// Times of the examined cases by line: all cases, or some of a long sweep.
class Times {
 public:
  void Add(const Case& one, double seconds) {
    Sum& sum = sums_[one.mechanism + "\n" + ToString(one.method)];
    sum.seconds += seconds;
    ++sum.cases;
  }

  /// Returns the time of the whole line [s].
  double Of(const CaseLine& line) const {
    const auto sum = sums_.find(line.mechanism + "\n" + line.method);
    if (sum == sums_.end()) return 0.0;
    return sum->second.seconds * static_cast<double>(line.cases) /
           static_cast<double>(sum->second.cases);
  }

 private:
  struct Sum {
    double seconds = 0.0;
    std::size_t cases = 0;
  };
  std::map<std::string, Sum> sums_;
};

/// Makes a plan; in a long sweep some combinations represent all.
Plan MakePlan(const Overview& overview, const PlanCommand& command, Estimate* estimate) {
  Plan plan;
  Times times;
  const std::vector<Experiment>& experiments = overview.experiments;
  std::set<std::string> references;
  std::size_t asked_references = 0;
  const std::map<std::string, double> earlier = EarlierTimes(command.from);
  std::vector<std::function<void()>> work;
  std::vector<Progress::Piece> pieces;
  const auto add = [&](const std::string& label, std::function<void()> one) {
    work.push_back(std::move(one));
    pieces.push_back({label, 0.0});
  };
  for (std::size_t i = 0; i < experiments.size(); ++i) {
    const Experiment& experiment = experiments[i];
    for (const Case& one : SelectCases(experiment, command.files.filter)) {
      add(fmt::format("{} {}", one.mechanism, ToString(one.method)), [&, i, one] {
        const auto known = earlier.find(SameRun(Identified(experiments[i], one).keys));
        plan.known += known != earlier.end() ? 1 : 0;
        const auto runs = static_cast<double>(RunsOf(one));
        times.Add(one, known != earlier.end() ? runs * known->second : estimate->OfCase(i, one));
        if (!experiments[i].reference) return;
        ++asked_references;
        const ReferenceCase reference = ReferenceOf(experiments[i], one, "results.jsonl");
        if (!references.insert(reference.id).second) return;
        plan.reference_seconds += estimate->OfReference(i, reference);
      });
    }
    for (const LadderGroup& ladder : LadderGroups(experiment, command.files.filter)) {
      add("in several scalars", [&, i, ladder] {
        plan.ladder_seconds += estimate->OfLadder(i, ladder);
        plan.rungs += ladder.keys.size();
      });
    }
    if (command.no_timing) continue;
    for (const TimingGroup& group : TimingGroups(experiment, command.files.filter)) {
      add("timings of " + group.name, [&, i, group] {
        plan.timing_seconds += estimate->OfTiming(i, group);
        plan.timings += group.cases.size();
      });
    }
  }
  Progress progress("estimate", std::move(pieces), 1);
  for (std::size_t i = 0; i < work.size(); ++i) {
    progress.Start(i);
    work[i]();
    progress.Done(i);
  }
  plan.references = references.size();
  for (const CaseLine& line : overview.lines) {
    plan.lines.push_back({line, times.Of(line)});
    plan.cases += line.cases;
    plan.runs += line.runs;
    plan.seconds += plan.lines.back().seconds;
  }
  if (overview.is_sample) {
    const double all =
        static_cast<double>(overview.combinations) / static_cast<double>(experiments.size());
    const auto scale = [all](std::size_t* count, double* seconds) {
      *count = static_cast<std::size_t>(std::llround(all * static_cast<double>(*count)));
      *seconds *= all;
    };
    scale(&plan.rungs, &plan.ladder_seconds);
    scale(&plan.timings, &plan.timing_seconds);
    // combinations of one motion share their reference: then there are no more than were found
    const bool is_one_each = plan.references >= std::min(asked_references, experiments.size());
    if (is_one_each) scale(&plan.references, &plan.reference_seconds);
  }
  return plan;
}

void PrintAxes(const Overview& overview) {
  if (overview.axes.empty()) return;
  for (const auto& [name, values] : overview.axes) Print("  axis {}: {} values\n", name, values);
  Print("  {} combinations\n", overview.combinations);
}

void PrintPlan(const Overview& overview, const Plan& plan, const PlanCommand& command,
               const Estimate& estimate) {
  const Experiment& first = overview.experiments.front();
  Print("{}{}{}\n", first.name, first.comment.empty() ? "" : ": ", first.comment);
  PrintAxes(overview);
  Print("  {} problems, {} methods, {} tolerances", first.problems.size(), first.methods.size(),
        first.tolerances.size());
  if (!first.fixed_steps.empty()) Print(", {} fixed steps", first.fixed_steps.size());
  if (first.integrators.size() > 1) Print(", {} integrators", first.integrators.size());
  Print("\n\n");
  Table table;
  table.columns = {{"mechanism", "mechanism"},
                   {"method", "method"},
                   {"cases", "cases", Format::kInteger},
                   {"runs", "runs", Format::kInteger},
                   {"seconds", "estimate [s]", Format::kShortest}};
  for (const Line& line : plan.lines) {
    AddRow({line.mechanism, line.method, line.cases, line.runs,
            std::round(line.seconds * 100.0) / 100.0},
           &table);
  }
  PrintText(ToScreen(table) + "\n");
  for (const std::string& one : estimate.cut_off()) {
    Print("Pilot run stopped: {}. Its cases are estimated by its CPU time.\n", one);
  }
  Print("{} cases, {} runs (ensembles in addition to the unperturbed run), {} timings\n",
        plan.cases, plan.runs, plan.timings);
  Print("estimated time: accuracy {} with one job", Duration(plan.seconds));
  if (plan.references > 0) {
    Print(", {} references {}", plan.references, Duration(plan.reference_seconds));
  }
  if (plan.rungs > 0) {
    Print(", {} runs in several floating-point types {}", plan.rungs,
          Duration(plan.ladder_seconds));
  }
  if (plan.timings > 0) Print(", timings {}", Duration(plan.timing_seconds));
  Print("\n");
  std::string source;
  if (!command.from.empty()) {
    source = fmt::format("{} of {} cases from {}", plan.known, plan.cases, command.from.string());
  }
  if (estimate.pilots() > 0) {
    source += fmt::format(
        "{}{} pilots over the first part of the longest horizon, at the loosest and the finest "
        "tolerance{}",
        source.empty() ? "" : ", the rest from ", estimate.pilots(),
        first.fixed_steps.empty() ? "" : ", or the longest fixed step");
  }
  if (overview.is_sample) {
    source += fmt::format("; {} combinations stand for all", overview.experiments.size());
  }
  Print("Estimated from {}. The limit of a run is {:g} s of CPU time.\n", source,
        first.limits.cpu_s);
}

JsonObject PlanDocument(const std::filesystem::path& path, const Overview& overview,
                        const Plan& plan, const Estimate& estimate) {
  std::vector<JsonObject> lines;
  for (const Line& line : plan.lines) {
    lines.push_back(JsonObject()
                        .Add("mechanism", line.mechanism)
                        .Add("method", line.method)
                        .Add("cases", Count(line.cases))
                        .Add("runs", Count(line.runs))
                        .Add("seconds", line.seconds));
  }
  return JsonObject()
      .Add("file", path.string())
      .Add("name", overview.experiments.front().name)
      .Add("combinations", Count(overview.combinations))
      .Add("cases", Count(plan.cases))
      .Add("runs", Count(plan.runs))
      .Add("accuracy_seconds", plan.seconds)
      .Add("references", Count(plan.references))
      .Add("reference_seconds", plan.reference_seconds)
      .Add("precision_runs", Count(plan.rungs))
      .Add("precision_seconds", plan.ladder_seconds)
      .Add("timings", Count(plan.timings))
      .Add("timing_seconds", plan.timing_seconds)
      .Add("cases_known", Count(plan.known))
      .Add("pilots", Count(estimate.pilots()))
      .Add("pilots_cut_off", estimate.cut_off())
      .Add("lines", lines);
}

int PrintPlans(const PlanCommand& command) try {
  const Interruption interruption;  // pilots leave no files
  std::vector<JsonObject> documents;
  for (const auto& path : command.files.paths) {
    const double begin = ThreadCpuSeconds();
    const Overview overview =
        MakeOverview(path, {{path}, command.files.settings, command.files.filter});
    RequirePeers(overview.experiments);
    Estimate estimate(overview.experiments, Estimate::Budget(), command.files.filter);
    Plan plan = MakePlan(overview, command, &estimate);
    plan.seconds += ThreadCpuSeconds() - begin;  // a run reads and expands the file too
    if (command.json) {
      documents.push_back(PlanDocument(path, overview, plan, estimate));
    } else {
      PrintPlan(overview, plan, command, estimate);
    }
  }
  if (command.json) PrintText(JsonObject().Add("experiments", documents).Text() + "\n");
  return 0;
} catch (const Interrupted& interrupted) {
  return interrupted.exit_code();
}

}  // namespace

void AddPlan(Commands& commands) {
  auto& command = commands.Keep<PlanCommand>();
  ExperimentFiles& files = command.files;
  commands.Add(
      "estimate", "Count cases and runs, and estimate their time",
      [&](const Typed&) { return PrintPlans(command); },
      {{"experiment", "Experiment files (JSON)", &files.paths, kRequired},
       {"--timings-from", "Earlier results whose times are used, not a pilot's", &command.from},
       FilterOption(&files.filter),
       {"--no-timing", "Skip timings", &command.no_timing},
       SetOption(&files.settings),
       WideOption(),
       JsonOption(&command.json)});
}

}  // namespace loopbench::harness
