// baseline: a repository's own baseline, measured again and compared with the committed one.
#include "harness/cli/commands.h"
#include "harness/run/run.h"

namespace loopbench::harness {
namespace {

struct BaselineCommand {
  std::string action;
  std::vector<std::filesystem::path> experiments;
  std::filesystem::path dir, counts, counter, keep;
  int jobs = 1;

  std::vector<Option> Options() {
    return {
        {"action", "Action", &action, kRequired, OneOf({"check", "renew", "selftest"})},
        {"--experiments", "Experiment files (JSON)", &experiments, kRequired, kExists, kTakesAll},
        {"--dir", "Folder of the baseline, to be committed", &dir, kRequired},
        {"--counts", "Benchmarks (JSON) for instruction counts by valgrind", &counts, kExists},
        {"--count-program", "Path of loopbench_count (default: beside this program, or in PATH)",
         &counter},
        {"-j,--jobs", "Cases to run in parallel", &jobs, From(1, 1024)},
        {"--keep-output", "New folder for the measurements (default: none)", &keep}};
  }
};

constexpr const char* kResults = "results.jsonl";

/// Requires a new folder for kept measurements.
void RequireNewFolder(const std::filesystem::path& kept, const std::filesystem::path& baseline) {
  const auto plain = [](const std::filesystem::path& path) {
    const auto whole = std::filesystem::weakly_canonical(path);
    return whole.has_filename() ? whole : whole.parent_path();
  };
  if (plain(kept) == plain(baseline)) {
    Reject("--keep-output: found {}, the folder of the baseline, expected another one",
           kept.string());
  }
  if (!std::filesystem::exists(kept)) return;
  if (!std::filesystem::is_directory(kept)) {
    Reject("--keep-output: found {}, which is no folder, expected a new one", kept.string());
  }
  if (!std::filesystem::is_empty(kept)) {
    Reject("--keep-output: found {}, which is not empty, expected a new folder", kept.string());
  }
}

std::string CounterOf(const BaselineCommand& command) {
  if (!command.counter.empty()) return command.counter.string();
  const auto beside =
      std::filesystem::read_symlink("/proc/self/exe").parent_path() / "loopbench_count";
  return std::filesystem::exists(beside) ? beside.string() : "loopbench_count";
}

void RequirePrograms(const BaselineCommand& command) {
  if (command.counts.empty()) return;
  const std::string counter = CounterOf(command);
  for (const std::string& program : {std::string("valgrind"), counter}) {
    const ProgramResult tried = RunProgram({program, "--version"});
    if (tried.error == 0) continue;
    Reject("--counts {}: {}{}", command.counts.string(), tried.Failure(program),
           program == "valgrind" ? "; install it: apt-get install valgrind"
                                 : "; set its path with --count-program");
  }
}

void MustRun(std::vector<std::string> words, const std::string& name) {
  const ProgramResult result = RunProgram(std::move(words));
  if (const std::string failure = result.Failure(name); !failure.empty()) {
    throw std::runtime_error(failure + result.output);
  }
}

/// Counts 20 evaluations per case, and `planted` more that are not reported.
void CountInstructions(const BaselineCommand& command, const std::filesystem::path& out,
                       int planted) {
  const std::string counter = CounterOf(command);
  const std::string dump = out.string() + ".callgrind";
  // without environment and, if possible, without address randomisation: the same instructions
  // every time
  std::vector<std::string> words = {"env", "-i"};
  if (RunProgram({"setarch", "-R", "true"}).status == 0)
    words.insert(words.end(), {"setarch", "-R"});
  words.insert(words.end(),
               {"valgrind", "-q", "--tool=callgrind", "--callgrind-out-file=" + dump,
                "--toggle-collect=CountedEvaluations", "--dump-after=CountedEvaluations", counter,
                command.counts.string(), "--planted", std::to_string(planted)});
  MustRun(std::move(words), "valgrind");
  MustRun({counter, command.counts.string(), "--callgrind", dump, "--out", out.string()}, counter);
}

/// Writes all measurements to work/results.jsonl; returns the exit code of an interruption, or 0.
int MeasureAll(const BaselineCommand& command, const std::filesystem::path& work) {
  Workload workload({command.experiments, {}, {}, 0}, {});
  if (workload.is_long()) {
    Reject(
        "found a sweep of more than {} combinations, expected a baseline "
        "of cases that are worth a look each",
        kLongSweep);
  }
  RequirePeers(workload.some());
  for (const Experiment& experiment : workload.some()) {
    RequireLadders(experiment);
    RequireReferences(experiment);
  }
  {
    ResultStore store(work / "run");
    FinishedRuns finished(work / "run");
    SuiteOptions options;
    options.jobs = command.jobs;
    options.timing = false;  // times belong to one machine: loopbench history
    try {
      RunSuite(workload, options, finished, store);
    } catch (const Interrupted& interrupted) {
      PrintError("interrupted: nothing was compared and nothing renewed\n");
      return interrupted.exit_code();
    }
  }
  std::string text = ReadFile(work / "run" / kResults);
  if (!command.counts.empty()) {
    CountInstructions(command, work / "counts.jsonl", 0);
    text += ReadFile(work / "counts.jsonl");
  }
  WriteFileAtomically(work / kResults, text);
  return 0;
}

std::vector<Record> Load(const std::filesystem::path& path) {
  std::vector<std::string> warnings;
  return ReadMeasurements(path, &warnings);
}

/// Returns the changed value of a record's measure, which the comparison must detect; null if the
/// record stays unchanged.
using PlantedValue = Value (*)(const Record& record, const CompareOptions& options);

struct Plant {
  const char *what, *measure;
  PlantedValue value;
};
constexpr Plant kPlants[] = {
    {"3 times the drift", "drift_position_max",
     [](const Record& record, const CompareOptions& options) {
       const double drift = record.Number("drift_position_max");
       return drift > options.error_floor ? Value(3.0 * drift) : Value();
     }},
    {"one step more", "steps",
     [](const Record& record, const CompareOptions&) {
       return Value(static_cast<std::int64_t>(record.Number("steps")) + 1);
     }},
    {"a bit of a final state", "state_hash",
     [](const Record&, const CompareOptions&) { return Value("0000000000000000"); }},
    {"a run that fails", "outcome", [](const Record& record, const CompareOptions&) {
       return record.Text("outcome") == "finished" ? Value("failed") : Value();
     }}};

bool IsCaught(const ComparisonReport& report, const CompareOptions& options,
              const std::string& measure) {
  return report.ExitCode(options) == 1 &&
         std::ranges::any_of(report.findings, [&measure](const Finding& finding) {
           const bool is_bad =
               finding.judgement == Judgement::kWorse || finding.judgement == Judgement::kDifferent;
           return is_bad && finding.measure.key == measure;
         });
}

/// Returns 1 if a planted change is not detected.
int SelfTest(const BaselineCommand& command, const std::filesystem::path& work) {
  const CompareOptions options;
  const std::vector<Record> base = Load(work / kResults);
  int missed = 0;
  const auto tell = [&missed](const std::string& what, bool is_caught) {
    Print("{}: {}\n", is_caught ? "caught" : "NOT CAUGHT", what);
    missed += !is_caught;
  };
  const bool is_same = Compare(base, base, options).ExitCode(options) == 0;
  Print("{}: measurements held against themselves\n", is_same ? "same" : "NOT THE SAME");
  missed += !is_same;
  for (const auto& [what, measure, value] : kPlants) {
    std::vector<Record> changed = base;
    const auto change = [&](Record& one) {
      const Value planted = one.Find(measure) == nullptr ? Value() : value(one, options);
      if (planted != Value()) one.Set(measure, planted);
      return planted != Value();
    };
    if (std::ranges::none_of(changed, change)) {
      Print("not planted: {}: no run has such a {}\n", what, measure);
      continue;
    }
    tell(what, IsCaught(Compare(base, changed, options), options, measure));
  }
  const std::vector<Record> fewer(base.begin(), base.end() - 1);
  tell("a case that is gone", Compare(base, fewer, options).ExitCode(options) == 2);
  if (!command.counts.empty()) {
    CountInstructions(command, work / "planted.jsonl", 1);
    std::vector<Record> changed = Load(work / "run");
    for (Record& one : Load(work / "planted.jsonl")) changed.push_back(std::move(one));
    tell("5 % more instructions",
         IsCaught(Compare(base, changed, options), options, "instructions"));
  }
  return missed == 0 ? 0 : 1;
}

int Baseline(const BaselineCommand& command, const Typed& typed) {
  if (!command.keep.empty()) RequireNewFolder(command.keep, command.dir);
  const auto baseline = command.dir / kResults;
  if (command.action == "check" && !std::filesystem::exists(baseline)) {
    Reject(
        "{}: no such file, expected the baseline; the first one is made by loopbench "
        "baseline renew",
        baseline.string());
  }
  if (command.action == "renew") RequireOutput(baseline);
  RequirePrograms(command);
  std::optional<TemporaryFolder> temporary;
  if (command.keep.empty()) temporary.emplace("loopbench");
  const std::filesystem::path work = temporary ? temporary->path() : command.keep;
  if (const int code = MeasureAll(command, work); code != 0) return code;
  RemoveAbandoned(command.dir);
  if (command.action == "selftest") return SelfTest(command, work);
  if (command.action == "check") return PrintComparison(command.dir, work / kResults, typed);
  WriteFileAtomically(baseline, ReadFile(work / kResults));
  Print("renewed {}: {}\n", baseline.string(), WithCount(Load(baseline).size(), "record"));
  return 0;
}

}  // namespace

void AddBaseline(Commands& commands) {
  commands.Add("baseline", "Keep and check a baseline of drift and counts", Baseline);
}

}  // namespace loopbench::harness
