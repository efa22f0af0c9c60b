#include "harness/suite/suite.h"

#include <sstream>
#include <unordered_set>

#include "harness/base/text.h"
#include "harness/observers/trajectory.h"
#include "harness/run/run.h"
#include "mechanism/algebra/lanes.h"

namespace loopbench::harness {

namespace {

constexpr double kPatience = 2.0, kGrace_s = 2.0;  ///< LimitsOfRuns
constexpr double kRecording_s = 30.0;              ///< for recordings, which no run counts

/// One process of a run: its expected records and the function that makes them.
struct Piece {
  std::vector<Record> owed;     ///< keys, case_id and content: complete except for results
  std::int64_t experiment = 0;  ///< index among the experiments of the command
  /// `beside`: other pieces of the process, null without any.
  std::function<std::vector<Record>(int threads, SideBySide* beside)> work;
  ProcessLimits limits;
  std::string label;
  double cost = 0.0;                      ///< expensive pieces run first
  std::string lanes = {};                 ///< pieces with equal names share calls; "": none
  int threads = 1;                        ///< threads of `work`, which may need fewer
  std::filesystem::path product = {};     ///< file that must exist for the piece to be done
  std::filesystem::path trajectory = {};  ///< file that its process may leave incomplete
  std::function<double(Estimate&)> seconds = {};
};

/// @param entry  case with its id
/// @param store  the store file; references lie in its folder
Piece AccuracyPiece(const Experiment& experiment, const Case& entry,
                    const std::filesystem::path& store) {
  std::filesystem::path trajectory;
  if (experiment.output) trajectory = TrajectoryPath(store, RunId(entry.keys));
  const auto work = [&experiment, entry, store, trajectory](int threads, SideBySide* beside) {
    const std::optional<Reference> reference = FindReference(experiment, entry, store);
    Record record =
        RunCase(experiment, entry, reference ? &*reference : nullptr, trajectory, threads, beside);
    if (reference && !reference->snapshots.empty()) {
      record.Set("reference_file", ReferenceOf(experiment, entry, store).id);
    }
    return std::vector<Record>{std::move(record)};
  };
  const auto runs = static_cast<double>(RunsOf(entry));
  ProcessLimits limits = LimitsOfRuns(entry.limits, runs * entry.method.threads);
  if (IsGenerated(entry.method.execution)) limits.cpu_s += kRecording_s;
  const std::string method = ToString(entry.method);
  // of an ensemble the members share calls; fused code may have other bits in lanes than alone
  const bool has_lanes = entry.method.execution == Execution::kGenerated && entry.ensemble <= 1;
  return {
      .owed = {entry.keys},
      .work = work,
      .limits = limits,
      .label = fmt::format("{} {} {}", entry.mechanism, method, SettingOf(entry)),
      .cost = entry.ensemble * ExpectedSteps(entry),
      .lanes = has_lanes ? fmt::format("{} {} {}", entry.mechanism, method, entry.integrator) : "",
      .trajectory = trajectory};
}

Piece ReferencePiece(const Experiment& experiment, const ReferenceCase& reference) {
  Limits limits = experiment.limits;
  if (experiment.reference) limits.cpu_s = experiment.reference->cpu_s;
  return {
      .owed = {reference.keys},
      .work = [&experiment, reference](
                  int, SideBySide*) { return std::vector<Record>{MakeOne(experiment, reference)}; },
      .limits = LimitsOfRuns(limits, kWitnesses),
      .label = fmt::format("{} {} s", reference.keys.Text("mechanism"), reference.horizon),
      .cost = reference.horizon,
      .product = reference.file};
}

Piece TimingPiece(const Experiment& experiment, const TimingGroup& group) {
  Piece piece;
  int threads = 1;
  for (const Case& entry : group.cases) {
    piece.owed.push_back(entry.keys);
    threads = std::max(threads, entry.method.threads);
  }
  // the first method is timed twice (record.h)
  const int methods = static_cast<int>(group.cases.size()) + 1;
  const int runs = methods * (experiment.timing.repeats + 1) * threads;
  // right-hand sides have no limit; a minute per method is ample
  constexpr double kDerivatives_s = 60.0;
  piece.limits = {kPatience * runs * experiment.limits.cpu_s + kDerivatives_s * methods * threads,
                  experiment.limits.memory_mb};
  piece.work = [&experiment, &group](int, SideBySide*) { return TimeTogether(experiment, group); };
  piece.label = group.name;
  return piece;
}

Piece LadderPiece(const Experiment& experiment, const LadderGroup& group) {
  return {
      .owed = group.keys,
      .work = [&experiment, &group](int, SideBySide*) { return ClimbTogether(experiment, group); },
      .limits = LimitsOfRuns(experiment.limits, group.runs()),
      .label =
          fmt::format("{} {}", group.keys.front().Text("mechanism"), ToString(group.task.method))};
}

/// Returns the answers of pieces, side by side where they share calls: records in lines (child).
std::vector<std::string> AnswersOf(const std::vector<Piece>& pieces,
                                   const std::vector<std::size_t>& asked) {
  std::vector<std::string> answers(asked.size());
  const auto answer = [&](int k, SideBySide* beside) {
    const Piece& piece = pieces[asked[static_cast<std::size_t>(k)]];
    std::string& text = answers[static_cast<std::size_t>(k)];
    if (const auto garbage = PlantedFault(piece.owed.front())) {
      text = *garbage;
      return;
    }
    for (const Record& record : piece.work(piece.threads, piece.lanes.empty() ? nullptr : beside)) {
      text += ToJsonLine(record) + '\n';
    }
  };
  const int count = static_cast<int>(asked.size());
  const bool have_lanes =
      std::ranges::any_of(asked, [&](std::size_t i) { return !pieces[i].lanes.empty(); });
  if (count > 1 && have_lanes) {
    RunSideBySide(count, 1, [&](int k, SideBySide& beside) { answer(k, &beside); });
  } else {
    for (int k = 0; k < count; ++k) answer(k, nullptr);
  }
  return answers;
}

/// Returns the expected records, filled from the answer or with the reason (parent process).
/// @param set  changes by --set
std::vector<Record> RecordsOf(const Piece& piece, const ProcessResult& result,
                              const std::string& set) {
  std::vector<Record> records;
  std::string outcome(OutcomeOf(result.ending)), message = result.text;
  if (result.ending == ProcessEnding::kThrew) message = "threw: " + message;
  if (result.ending == ProcessEnding::kAnswered) {
    outcome = "invalid-result";
    message = "the output of its process is not a record of this case";
    try {
      std::istringstream lines(result.text);
      for (std::string line; std::getline(lines, line);) records.push_back(FromJsonLine(line));
    } catch (const std::runtime_error&) {
      records.clear();
    }
  }
  const auto same_case = [](const Record& a, const Record& b) {
    return a.Text("case_id") == b.Text("case_id");
  };
  const bool good = std::ranges::equal(records, piece.owed, same_case);
  if (!good) records = piece.owed;
  for (std::size_t i = 0; i < records.size(); ++i) {
    if (!good) {
      records[i].Set("outcome", outcome);
      records[i].Set("message", message);
      records[i].Set("wall_s", result.wall_s);
      records[i].Set("cpu_s", result.cpu_s);
    }
    records[i].Set("id", RunId(piece.owed[i]));
    records[i].Set("version", CodeVersion());
    if (!set.empty()) records[i].Set("set", set);
    records[i].Set("experiment_index", piece.experiment);
    Stamp(records[i]);
  }
  return records;
}

/// Runs the pieces that a store does not contain yet, and stores their records.
class Runner {
 public:
  /// `finished`: records in the store when the run begins.
  Runner(const SuiteOptions& options, FinishedRuns& finished, ResultStore& store)
      : options_(options), finished_(finished), store_(store) {}

  /// Runs the unfinished ones of `pieces`, which are in the order of the experiments.
  /// @param estimate  time estimates of their experiments, used if a progress line is visible
  /// @param shared    short pieces may share a process
  /// @returns  number of their records with an outcome other than "finished"
  std::size_t Run(const std::string& what, std::vector<Piece> pieces, int jobs, bool shared,
                  Estimate& estimate) {
    // a case of two files runs once
    std::erase_if(pieces, [&](const Piece& piece) { return !IsNew(piece); });
    std::ranges::stable_sort(pieces, [](const Piece& a, const Piece& b) {
      return std::pair(-a.cost, std::string_view(a.lanes)) <
             std::pair(-b.cost, std::string_view(b.lanes));
    });
    std::size_t failed = 0;
    std::erase_if(pieces, [&](const Piece& piece) { return IsDone(piece, &failed); });
    if (pieces.empty()) return failed;
    std::vector<Progress::Piece> shown;
    for (Piece& piece : pieces) {
      // spare jobs become threads of the ensembles
      piece.threads = std::max(1, jobs / static_cast<int>(pieces.size()));
      shown.push_back({piece.label, Progress::IsSeen() ? piece.seconds(estimate)
                                                       : std::numeric_limits<double>::quiet_NaN()});
    }
    Progress progress(what, std::move(shown), jobs);
    const auto work = [&](const std::vector<std::size_t>& asked) {
      store_.LeaveToParent();
      return AnswersOf(pieces, asked);
    };
    const auto limits = [&](std::size_t i) {
      if (!shared) CalibrationNs();  // calibrates the machine speed for timings, before the fork
      return pieces[i].limits;
    };
    const auto keep = [&](const std::vector<TaskResult>& ended) {
      std::vector<Record> records;
      for (const auto& [i, result] : ended) {
        if (!pieces[i].trajectory.empty()) RemovePart(pieces[i].trajectory);
        for (Record& record : RecordsOf(pieces[i], result, options_.set)) {
          const bool is_finished = record.Text("outcome") == ToString(Outcome::kFinished);
          ++count.run;
          count.failed += !is_finished;
          failed += !is_finished;
          records.push_back(std::move(record));
        }
      }
      store_.Append(records);
      for (const TaskResult& result : ended) progress.Done(result.task);
    };
    const auto together = [&](std::size_t first) -> std::size_t {
      const std::string& lanes = pieces[first].lanes;
      std::size_t last = first + 1;
      const std::size_t most =
          std::min(pieces.size(), first + static_cast<std::size_t>(kLanes * jobs));
      while (!lanes.empty() && last < most && pieces[last].lanes == lanes) ++last;
      return (last - first - 1) / static_cast<std::size_t>(jobs) + 1;
    };
    const auto started = [&](std::size_t i) { progress.Start(i); };
    const auto waited = [&] { progress.Look(); };
    count.processes += RunInSharedProcesses(pieces.size(), jobs, work, limits, keep,
                                            {shared, together}, {started, waited});
    count.pieces += pieces.size();
    return failed;
  }

  /// Forgets all requests so far: cases of a long sweep are distinguished within their group only.
  void Forget() {
    asked_.clear();
    count.ids.clear();
  }

  SuiteCount count;

 private:
  bool IsNew(const Piece& piece) {
    bool is_new = false;
    for (const Record& owed : piece.owed) {
      const std::string id = RunId(owed);
      if (!asked_.insert(id).second) continue;
      is_new = true;
      count.ids.push_back(id);
    }
    return is_new;
  }

  /// Returns true for a piece that need not run, and counts its records, `failed` ones too.
  bool IsDone(const Piece& piece, std::size_t* failed) {
    if (options_.rerun == Rerun::kAll) return false;
    if (!piece.product.empty() && !std::filesystem::exists(piece.product)) return false;
    std::size_t not_finished = 0;
    for (const Record& owed : piece.owed) {
      const std::optional<bool> finished = finished_.Find(RunId(owed));
      if (!finished || (!*finished && options_.rerun == Rerun::kFailed)) return false;
      not_finished += !*finished;
    }
    *failed += not_finished;
    count.skipped += piece.owed.size();
    return true;
  }

  const SuiteOptions& options_;
  FinishedRuns& finished_;
  ResultStore& store_;
  std::unordered_set<std::string> asked_;  ///< ids
};

/// Warns about more jobs than processors: time limits count CPU time, so outcomes do not change.
void WarnOfJobs(int jobs, const std::vector<Experiment>& experiments) {
  const int processors = ReadMachineState().processors;
  const char* plural = processors == 1 ? "" : "s";
  int threads = 1;
  for (const Experiment& experiment : experiments) {
    for (const Method& method : experiment.methods) threads = std::max(threads, method.threads);
  }
  if (threads > 1 && jobs * threads > processors) {
    PrintError(
        "warning: --jobs {} of up to {} threads on {} processor{}: they wait for each other\n",
        jobs, threads, processors, plural);
  }
  if (jobs <= processors) return;
  PrintError(
      "warning: --jobs {} on {} processor{}: the runs share processors, and together may use {} "
      "times the memory of one\n",
      jobs, processors, plural, jobs);
}

/// Pieces of one group, kind by kind.
class Group {
 public:
  /// @param pilots_s  wall time of pilots: small, because the user waits for them
  /// @param store     the store file
  Group(const ExperimentGroup& group, const SuiteOptions& options, double pilots_s, Runner& runner,
        const std::filesystem::path& store)
      : group_(group),
        experiments_(group.experiments),
        options_(options),
        runner_(runner),
        store_(store),
        estimate_(experiments_,
                  {.share = 0.01, .least_s = 0.003, .most_s = 0.25, .all_s = pilots_s},
                  options.filter) {}

  /// Run all pieces of a kind; return the number of records of runs that did not finish.
  std::size_t Accuracy() {
    KeepMechanisms(experiments_, store_);
    std::vector<Piece> references;
    for (std::size_t e = 0; e < experiments_.size(); ++e) {
      const Experiment& experiment = experiments_[e];
      for (const Case& entry : SelectCases(experiment, options_.filter)) {
        const bool is_taken =
            Add(e, AccuracyPiece(experiment, Identified(experiment, entry), store_),
                [e, entry](Estimate& estimate) { return estimate.OfCase(e, entry); });
        if (!is_taken || !HasReference(experiment, entry)) continue;
        const ReferenceCase reference = ReferenceOf(experiment, entry, store_);
        references.push_back(ReferencePiece(experiment, reference));
        references.back().experiment = group_.numbers[e];
        references.back().seconds = [e, reference](Estimate& estimate) {
          return estimate.OfReference(e, reference);
        };
      }
    }
    const std::size_t failed =
        runner_.Run(Named("references"), std::move(references), options_.jobs, false, estimate_);
    return failed + Run("accuracy", options_.jobs, !options_.isolate);
  }

  std::size_t Ladders() {
    return RunGroups("precision", options_.jobs, LadderGroups, LadderPiece, &Estimate::OfLadder);
  }

  std::size_t Timings() {
    return RunGroups("timing", 1, TimingGroups, TimingPiece, &Estimate::OfTiming);
  }

 private:
  /// Returns true if the piece belongs to this shard. Duplicate pieces of two files count once.
  bool Add(std::size_t e, Piece piece, std::function<double(Estimate&)> seconds) {
    if (!group_.is_sharded) {
      bool is_new = false;
      for (const Record& owed : piece.owed) is_new |= dealt_.insert(RunId(owed)).second;
      if (!is_new || !options_.shard.Takes(number_++)) return false;
    }
    piece.experiment = group_.numbers[e];
    piece.seconds = std::move(seconds);
    pieces_.push_back(std::move(piece));
    return true;
  }

  /// Runs the groups of all experiments, each as one piece.
  template <class Kind>
  std::size_t RunGroups(const char* what, int jobs,
                        std::vector<Kind> (*groups_of)(const Experiment&, const Selection&),
                        Piece (*piece_of)(const Experiment&, const Kind&),
                        double (Estimate::*seconds)(std::size_t, const Kind&)) {
    std::vector<std::vector<Kind>> groups;  // pieces refer to them
    for (const Experiment& experiment : experiments_) {
      groups.push_back(groups_of(experiment, options_.filter));
    }
    for (std::size_t e = 0; e < experiments_.size(); ++e) {
      for (const Kind& group : groups[e]) {
        Add(e, piece_of(experiments_[e], group),
            [e, &group, seconds](Estimate& estimate) { return (estimate.*seconds)(e, group); });
      }
    }
    return Run(what, jobs, false);
  }

  std::size_t Run(const char* what, int jobs, bool shared) {
    number_ = 0;
    return runner_.Run(Named(what), std::exchange(pieces_, {}), jobs, shared, estimate_);
  }

  std::string Named(const char* what) const {
    return group_.name.empty() ? what : fmt::format("{}, {},", what, group_.name);
  }

  const ExperimentGroup& group_;
  const std::vector<Experiment>& experiments_;
  const SuiteOptions& options_;
  Runner& runner_;
  const std::filesystem::path store_;
  Estimate estimate_;
  std::vector<Piece> pieces_;
  std::size_t number_ = 0;                 ///< number of the next piece, for sharding
  std::unordered_set<std::string> dealt_;  ///< ids of the pieces of all shards
};

/// Returns the hash of the last bytes of the store before `end`; "" if they cannot be read.
std::string HashBefore(std::ifstream& store, std::uintmax_t end) {
  constexpr std::uintmax_t kLast = 512;
  const std::uintmax_t begin = end - std::min(end, kLast);
  std::string bytes(static_cast<std::size_t>(end - begin), '\0');
  store.clear();
  store.seekg(static_cast<std::streamoff>(begin));
  store.read(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  return store.gcount() == static_cast<std::streamsize>(bytes.size()) ? Fnv1a(bytes) : "";
}

struct GroupMark {
  std::size_t records = 0, failed = 0;
};

/// Marks of completed groups of a long sweep, next to the store, which a resumed run omits.
///
/// A mark is a line of results.groups: content (Workload::content()), kind, group, number of
/// records, number of unfinished runs, and state of the store. The state is its length and a hash
/// of its last bytes. A mark is valid only while the store up to that length is unchanged. The
/// marks are a cache; deleting them is safe.
class GroupMarks {
 public:
  /// Reads the marks of this content that are valid for the store.
  /// @param store  the store file
  GroupMarks(const std::filesystem::path& store, std::string content)
      : store_(store),
        file_(std::filesystem::path(store).replace_extension(".groups")),
        content_(std::move(content)) {
    std::ifstream lines(file_), bytes(store_, std::ios::binary);
    std::error_code error;
    const std::uintmax_t size = std::filesystem::file_size(store_, error);
    if (error) return;
    for (std::string line; std::getline(lines, line);) {
      std::istringstream words(line);
      std::string of, kind, hash, end;
      std::size_t group = 0;
      std::uintmax_t length = 0;
      GroupMark mark;
      words >> of >> kind >> group >> mark.records >> mark.failed >> length >> hash >> end;
      // an incomplete line has no end mark
      if (of != content_ || end != "." || length > size) continue;
      if (HashBefore(bytes, length) == hash) marks_[{kind, group}] = mark;
    }
  }

  std::optional<GroupMark> Find(const std::string& kind, std::size_t group) const {
    const auto mark = marks_.find({kind, group});
    return mark == marks_.end() ? std::nullopt : std::optional(mark->second);
  }

  /// Marks a group whose records are all in the store. Ignores write errors.
  void Add(const std::string& kind, std::size_t group, const GroupMark& mark) {
    std::error_code error;
    const std::uintmax_t size = std::filesystem::file_size(store_, error);
    std::ifstream bytes(store_, std::ios::binary);
    if (error || size == 0) return;
    marks_[{kind, group}] = mark;
    std::ofstream(file_, std::ios::app)
        << fmt::format("{} {} {} {} {} {} {} .\n", content_, kind, group, mark.records, mark.failed,
                       size, HashBefore(bytes, size));
  }

 private:
  std::filesystem::path store_, file_;
  std::string content_;
  std::map<std::pair<std::string, std::size_t>, GroupMark> marks_;
};

}  // namespace

ProcessLimits LimitsOfRuns(const Limits& limits, double runs) {
  return {.cpu_s = kPatience * runs * limits.cpu_s + kGrace_s, .memory_mb = limits.memory_mb};
}

std::vector<Case> SelectCases(const Experiment& experiment, const Selection& filter) {
  std::vector<Case> cases = Expand(experiment);
  std::erase_if(cases, [&](const Case& entry) { return !Matches(entry.keys, filter); });
  if (cases.empty()) {
    throw ConfigError(
        fmt::format("{}: no case matches {}", experiment.path.string(), ToText(filter)));
  }
  return cases;
}

SuiteCount RunSuite(Workload& workload, const SuiteOptions& options, FinishedRuns& finished,
                    ResultStore& store) {
  WarnOfJobs(options.jobs, workload.some());
  RemoveParts(store.file());
  for (const char* folder : {".", "references", "mechanisms"}) {
    RemoveAbandoned(store.file().parent_path() / folder);
  }
  const Interruption interruption;
  Runner runner(options, finished, store);
  GroupMarks marks(store.file(), workload.content());
  struct Kind {
    const char* name;
    bool is_wanted;
    std::size_t (Group::*run)();
  };
  double pilots_s = 2.0;  // groups of a long sweep are extrapolated from the first one
  for (const Kind& kind : {Kind{"accuracy", options.accuracy, &Group::Accuracy},
                           Kind{"precision", options.precision, &Group::Ladders},
                           Kind{"timing", options.timing, &Group::Timings}}) {
    for (std::size_t g = 0; kind.is_wanted && g < workload.groups(); ++g) {
      const std::optional<GroupMark> mark =
          workload.is_long() ? marks.Find(kind.name, g) : std::nullopt;
      if (mark && (options.rerun == Rerun::kNone ||
                   (options.rerun == Rerun::kFailed && mark->failed == 0))) {
        runner.count.skipped += mark->records;
        continue;
      }
      Interruption::Check();
      const ExperimentGroup experiments = workload.Read(g);
      const std::size_t before = runner.count.run + runner.count.skipped;
      Group group(experiments, options, pilots_s, runner, store.file());
      const std::size_t failed = (group.*kind.run)();
      if (!workload.is_long()) continue;
      marks.Add(kind.name, g, {runner.count.run + runner.count.skipped - before, failed});
      runner.Forget();
      pilots_s = 0.0;
    }
  }
  return runner.count;
}
}  // namespace loopbench::harness
