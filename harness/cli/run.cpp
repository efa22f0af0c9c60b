// run, merge and estimate: experiments into a store, stores into one, and the time before.
#include "harness/run/run.h"

#include "harness/cli/commands.h"
#include "harness/judge/analysis.h"

namespace loopbench::harness {
namespace {

struct RunCommand {
  std::vector<std::filesystem::path> experiments;
  std::filesystem::path out;
  SuiteOptions suite;
  std::vector<std::string> settings;  ///< --set, as typed
  std::string shard = "1/1", rerun = "none", gate;
  int threads = 0;
  bool wait = false, no_timing = false, timing_only = false, precision_only = false;

  std::vector<Option> Options() {
    return {
        {"experiment", "Experiment files (JSON)", &experiments, kRequired},
        {"-o,--out",
         "Folder for results.jsonl, drift.csv and timing.csv (default: results/runs/NAME)", &out},
        {"-j,--jobs", "Accuracy cases to run in parallel; timings run alone", &suite.jobs,
         From(1, 1024)},
        {"--threads", "Threads per right-hand side (O-DCA, large mechanisms); same results",
         &threads, From(1, kMaxThreads)},
        FilterOption(&suite.filter),
        {"--set", "Change a field of the file: /json/pointer=value", &settings},
        WideOption(),
        {"--shard", "Run part K of N; merge joins the parts", &shard},
        {"--isolate", "Run each case in its own process; otherwise short cases share processes",
         &suite.isolate},
        {"--wait", "Wait while another process writes to the store, then continue", &wait},
        {"--rerun", "Stored cases to run again", &rerun, OneOf({"none", "failed", "all"})},
        GateOption(&gate),
        {"--no-timing", "Skip timings", &no_timing},
        {"--timing-only", "Run timings only", &timing_only, Excludes({"--no-timing", "--fail-on"})},
        {"--precision-only", "Run only precision studies (several floating-point types)",
         &precision_only, Excludes({"--no-timing", "--timing-only", "--fail-on"})}};
  }
};

/// If interrupted, prints the number of kept results and returns 128 + the signal number.
int RunExperiments(RunCommand& command, const Typed& typed) {
  std::vector<Setting> settings;
  for (const std::string& text : command.settings) settings.push_back(ParseSetting(text));
  command.suite.timing = !command.no_timing && !command.precision_only;
  command.suite.accuracy = !command.timing_only && !command.precision_only;
  command.suite.precision = !command.timing_only;
  command.suite.set = fmt::format("{}", fmt::join(command.settings, " "));
  command.suite.shard = ParseShard(command.shard);
  command.suite.rerun = command.rerun == "all"      ? Rerun::kAll
                        : command.rerun == "failed" ? Rerun::kFailed
                                                    : Rerun::kNone;
  // read everything first: a mistake in the last file must not cost the runs of the first
  Workload workload({command.experiments, settings, command.suite.filter, command.threads},
                    command.suite.shard);
  if (workload.is_long() && !command.gate.empty()) {
    Reject(
        "--fail-on {}: found a sweep of more than {} combinations, whose records are not held at "
        "once; judge parts of it: loopbench table STORE --where ... --fail-on {}",
        command.gate, kLongSweep, command.gate);
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
      std::ifstream file(store.file(), std::ios::binary);
      const auto records = std::count(std::istreambuf_iterator<char>(file), {}, '\n');
      PrintError(
          "interrupted: {} kept in {}, {} of them of this run; cases under way were stopped and "
          "left nothing, tables were not written\n",
          WithCount(records, "record"), store.file().string(), store.appended());
      PrintError("to resume{}\n", command.suite.rerun == Rerun::kAll
                                      ? ", without those that were run again: the same command "
                                        "with --rerun none"
                                      : ": " + typed.again);
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
  // of the store only the requested cases
  std::map<std::string, Record> last;
  for (Record& record : ReadRecords(out)) last[record.Text("id")] = std::move(record);
  std::vector<Record> records = WithContents(
      Mapped<Record>(count.ids, [&last](const std::string& id) { return last.at(id); }));
  SetWarnings(&records);
  WriteTables(records, out, typed.line);
  Print("results in {}\n", out.string());
  return command.gate.empty() ? 0 : WarningGate(records);
}

struct PlanCommand {
  ExperimentFiles files;
  std::filesystem::path from;
  bool no_timing = false, json = false;

  std::vector<Option> Options() {
    return {{"experiment", "Experiment files (JSON)", &files.paths, kRequired},
            {"--timings-from", "Earlier results whose times are used, not a pilot's", &from},
            FilterOption(&files.filter),
            {"--no-timing", "Skip timings", &no_timing},
            SetOption(&files.settings),
            WideOption(),
            JsonOption(&json)};
  }
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

struct Work {
  std::size_t count = 0;
  double seconds = 0.0;

  void Add(std::size_t more, double more_seconds) {
    count += more;
    seconds += more_seconds;
  }
  void Scale(double factor) {
    count = static_cast<std::size_t>(std::llround(factor * static_cast<double>(count)));
    seconds *= factor;
  }
};

struct Plan {
  std::vector<Line> lines;
  Work runs, references, rungs, timings;
  std::size_t cases = 0, known = 0;
};

/// In a long sweep some combinations represent all.
Plan MakePlan(const Overview& overview, const PlanCommand& command, Estimate* estimate) {
  Plan plan;
  // seconds and number of the examined cases of each line: all cases, or some of a long sweep
  std::map<std::string, std::pair<double, std::size_t>> times;
  const std::vector<Experiment>& experiments = overview.experiments;
  std::set<std::string> references;
  std::size_t asked_references = 0;
  std::map<std::string, double> earlier;  // CPU times [s] of unperturbed runs by SameRun()
  for (const Record& record :
       command.from.empty() ? std::vector<Record>() : ReadRecords(command.from)) {
    // wall time depends on how many runs shared the processors
    if (record.Text("kind") != "accuracy" || std::isnan(record.Number("cpu_s"))) continue;
    earlier[SameRun(record)] = record.Number("cpu_s");
  }
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
        auto& [seconds, cases] = times[one.mechanism + "\n" + ToString(one.method)];
        seconds += known != earlier.end() ? runs * known->second : estimate->OfCase(i, one);
        ++cases;
        if (!experiments[i].reference) return;
        ++asked_references;
        const ReferenceCase reference = ReferenceOf(experiments[i], one, "results.jsonl");
        if (!references.insert(reference.id).second) return;
        plan.references.Add(1, estimate->OfReference(i, reference));
      });
    }
    for (const LadderGroup& ladder : LadderGroups(experiment, command.files.filter)) {
      add("in several scalars",
          [&, i, ladder] { plan.rungs.Add(ladder.keys.size(), estimate->OfLadder(i, ladder)); });
    }
    if (command.no_timing) continue;
    for (const TimingGroup& group : TimingGroups(experiment, command.files.filter)) {
      add("timings of " + group.name,
          [&, i, group] { plan.timings.Add(group.cases.size(), estimate->OfTiming(i, group)); });
    }
  }
  Progress progress("estimate", std::move(pieces), 1);
  for (std::size_t i = 0; i < work.size(); ++i) {
    progress.Start(i);
    work[i]();
    progress.Done(i);
  }
  for (const CaseLine& line : overview.lines) {
    const auto& [seconds, cases] = times[line.mechanism + "\n" + line.method];
    plan.lines.push_back({line, cases == 0 ? 0.0
                                           : seconds * static_cast<double>(line.cases) /
                                                 static_cast<double>(cases)});
    plan.cases += line.cases;
    plan.runs.Add(line.runs, plan.lines.back().seconds);
  }
  if (overview.is_sample) {
    const double all =
        static_cast<double>(overview.combinations) / static_cast<double>(experiments.size());
    plan.rungs.Scale(all);
    plan.timings.Scale(all);
    // combinations of one motion share their reference: then there are no more than were found
    if (references.size() >= std::min(asked_references, experiments.size())) {
      plan.references.Scale(all);
    }
  }
  return plan;
}

void PrintPlan(const Overview& overview, const Plan& plan, const PlanCommand& command,
               const Estimate& estimate) {
  const Experiment& first = overview.experiments.front();
  Print("{}{}{}\n", first.name, first.comment.empty() ? "" : ": ", first.comment);
  for (const auto& [name, values] : overview.axes)
    Print("  axis {}: {}\n", name, WithCount(values, "value"));
  if (!overview.axes.empty()) Print("  {}\n", WithCount(overview.combinations, "combination"));
  Print("  {}, {}, {}", WithCount(first.problems.size(), "problem"),
        WithCount(first.methods.size(), "method"), WithCount(first.tolerances.size(), "tolerance"));
  if (!first.fixed_steps.empty()) Print(", {}", WithCount(first.fixed_steps.size(), "fixed step"));
  if (first.integrators.size() > 1) Print(", {} integrators", first.integrators.size());
  Print("\n\n");
  Table table{.columns = Columns(
                  "mechanism, method, cases:integer, runs:integer, seconds=estimate [s]:shortest")};
  for (const Line& line : plan.lines) {
    AddRow({line.mechanism, line.method, line.cases, line.runs,
            std::round(line.seconds * 100.0) / 100.0},
           &table);
  }
  PrintText(ToScreen(table) + "\n");
  for (const std::string& one : estimate.cut_off()) {
    Print("Pilot run stopped: {}. Its cases are estimated by its CPU time.\n", one);
  }
  Print("{}, {} (ensembles in addition to the unperturbed run), {}\n",
        WithCount(plan.cases, "case"), WithCount(plan.runs.count, "run"),
        WithCount(plan.timings.count, "timing"));
  Print("estimated time: accuracy {} with one job", Duration(plan.runs.seconds));
  if (plan.references.count > 0) {
    Print(", {} {}", WithCount(plan.references.count, "reference"),
          Duration(plan.references.seconds));
  }
  if (plan.rungs.count > 0) {
    Print(", {} in several floating-point types {}", WithCount(plan.rungs.count, "run"),
          Duration(plan.rungs.seconds));
  }
  if (plan.timings.count > 0) Print(", timings {}", Duration(plan.timings.seconds));
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
  std::vector<JsonObject> lines = Mapped<JsonObject>(plan.lines, [](const Line& line) {
    return JsonOf("mechanism", line.mechanism, "method", line.method, "cases", line.cases, "runs",
                  line.runs, "seconds", line.seconds);
  });
  return JsonOf("file", path, "name", overview.experiments.front().name, "combinations",
                overview.combinations, "cases", plan.cases, "runs", plan.runs.count,
                "accuracy_seconds", plan.runs.seconds, "references", plan.references.count,
                "reference_seconds", plan.references.seconds, "precision_runs", plan.rungs.count,
                "precision_seconds", plan.rungs.seconds, "timings", plan.timings.count,
                "timing_seconds", plan.timings.seconds, "cases_known", plan.known, "pilots",
                estimate.pilots(), "pilots_cut_off", estimate.cut_off(), "lines", lines);
}

int PrintPlans(const PlanCommand& command, const Typed&) try {
  const Interruption interruption;  // pilots leave no files
  std::vector<JsonObject> documents;
  for (const auto& path : command.files.paths) {
    const double begin = ThreadCpuSeconds();
    const Overview overview =
        MakeOverview(path, {{path}, command.files.settings, command.files.filter});
    RequirePeers(overview.experiments);
    Estimate estimate(overview.experiments, Estimate::Budget(), command.files.filter);
    Plan plan = MakePlan(overview, command, &estimate);
    plan.runs.seconds += ThreadCpuSeconds() - begin;  // a run reads and expands the file too
    if (command.json) {
      documents.push_back(PlanDocument(path, overview, plan, estimate));
    } else {
      PrintPlan(overview, plan, command, estimate);
    }
  }
  return command.json ? PrintJson(JsonOf("experiments", documents)) : 0;
} catch (const Interrupted& interrupted) {
  return interrupted.exit_code();
}

}  // namespace

int Merge(const MergeCommand& command, const Typed&) {
  NewStore target(command.out);
  const MergedStores merged(command.stores, command.order);
  if (!merged.missing().empty()) {
    PrintError(
        "{}: {} of {} cases are in no part, {} among them; nothing was merged. The experiment, its "
        "mechanisms or the program changed since the shards ran\n",
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
  std::map<std::string, std::size_t> kinds = {{"accuracy", 0}};
  for (std::size_t i = 0; i < merged.size(); ++i) {
    const Record record = merged[i];
    ++kinds[record.Text("kind")];
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
  Print("{} of {}: {} in {}\n", WithCount(merged.read(), "record"),
        WithCount(command.stores.size(), "store"),
        Joined(kinds, ", ",
               [](const auto& kind) {
                 return WithCount(kind.second,
                                  kind.first == "accuracy" ? "case" : kind.first + " record");
               }),
        target.file().string());
  if (!references.texts.empty()) {
    Print("{} beside it\n", WithCount(references.texts.size(), "reference"));
  }
  return 0;
}

void AddRun(Commands& commands) {
  commands.Add("run", "Run experiments (resumes an interrupted run) and write results",
               RunExperiments);
  commands.Add("merge", "Join the stores of shards", Merge);
  commands.Add("estimate", "Count cases and runs, and estimate their time", PrintPlans);
}

}  // namespace loopbench::harness
