#include "harness/suite/suite.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <optional>
#include <set>
#include <utility>

#include "harness/isolation/fault.h"
#include "harness/isolation/interruption.h"
#include "harness/isolation/processes.h"
#include "harness/record/noise.h"
#include "harness/record/origin.h"
#include "harness/record/provenance.h"
#include "harness/run/case_identity.h"
#include "harness/run/run_case.h"
#include "harness/suite/estimate.h"
#include "harness/suite/kept_files.h"
#include "harness/suite/precision_cases.h"
#include "harness/suite/progress.h"
#include "harness/suite/reference_cases.h"
#include "harness/text/config_error.h"
#include "harness/text/terminal.h"
#include "harness/timing/time_cases.h"
#include "harness/trajectory/trajectory.h"
#include "harness/trajectory/trajectory_writer.h"

namespace loopbench::harness {

namespace {

/// Costly cases go first, so that none is left to run alone at the end.
double Cost(const Case& one) { return one.ensemble * ExpectedSteps(one); }

/// One process: the records it owes, known but for their results, and how to make them.
struct Piece {
  std::vector<Record> owed;     ///< keys, case_id and content
  std::int64_t experiment = 0;  ///< which of the command's
  std::function<std::vector<Record>()> work;
  ProcessLimits limits;
  std::string label;
  double cost = 0.0;
  std::filesystem::path product = {};     ///< a file without which the piece is not done
  std::filesystem::path trajectory = {};  ///< one that its process may leave unfinished
  std::function<double(Estimate&)> seconds = {};
};

constexpr double kPatience = 2.0, kGrace_s = 2.0;  ///< LimitsOfRuns
/// A person waits for the pilots before the first case begins.
constexpr Estimate::Budget kForProgress = {
    .share = 0.01, .least_s = 0.003, .most_s = 0.25, .all_s = 2.0};

/// @param one    with its id
/// @param store  the file beside which references are kept
Piece AccuracyPiece(const Experiment& experiment, const Case& one,
                    const std::filesystem::path& store) {
  const int runs = one.ensemble > 1 ? one.ensemble + 1 : 1;
  std::filesystem::path trajectory;
  if (experiment.output) trajectory = TrajectoryPath(store, RunId(one.keys));
  const auto work = [&experiment, one, store, trajectory] {
    const std::optional<Reference> reference = FindReference(experiment, one, store);
    Record record = RunCase(experiment, one, reference ? &*reference : nullptr, trajectory);
    if (reference && !reference->snapshots.empty()) {
      record.Set("reference_file", ReferenceOf(experiment, one, store).id);
    }
    return std::vector<Record>{std::move(record)};
  };
  return {.owed = {one.keys},
          .work = work,
          .limits = LimitsOfRuns(one.limits, runs * one.column.threads),
          .label = fmt::format("{} {} {}", one.mechanism, ToString(one.column), SettingOf(one)),
          .cost = Cost(one),
          .trajectory = trajectory};
}

Piece ReferencePiece(const Experiment& experiment, const ReferenceCase& one) {
  Limits limits = experiment.limits;
  if (experiment.reference) limits.cpu_s = experiment.reference->cpu_s;
  constexpr double kWitnesses = 3.0;
  return {.owed = {one.keys},
          .work = [&experiment, one] { return std::vector<Record>{MakeOne(experiment, one)}; },
          .limits = LimitsOfRuns(limits, kWitnesses),
          .label = fmt::format("{} {} s", one.keys.Text("mechanism"), one.horizon),
          .cost = one.horizon,
          .product = one.file};
}

Piece TimingPiece(const Experiment& experiment, const TimingGroup& group) {
  Piece piece;
  for (const Case& one : group.cases) piece.owed.push_back(one.keys);
  // the first column is timed twice (noise.h)
  const int columns = static_cast<int>(group.cases.size()) + 1;
  int threads = 1;
  for (const Case& one : group.cases) threads = std::max(threads, one.column.threads);
  const int runs = columns * (experiment.timing.repeats + 1) * threads;
  // right-hand sides have no limit of their own; a minute per column is far beyond any
  constexpr double kDerivatives_s = 60.0;
  piece.limits = {kPatience * runs * experiment.limits.cpu_s + kDerivatives_s * columns * threads,
                  experiment.limits.memory_mb};
  piece.work = [&experiment, &group] { return TimeTogether(experiment, group); };
  piece.label = group.name;
  return piece;
}

Piece LadderPiece(const Experiment& experiment, const LadderGroup& group) {
  Piece piece;
  const Limits& limits = experiment.limits;
  piece.owed = group.keys;
  const auto runs = static_cast<double>(group.keys.size() + 1);  // there are two references
  piece.limits = LimitsOfRuns(limits, runs);
  piece.work = [&experiment, &group] { return ClimbTogether(experiment, group); };
  piece.label =
      fmt::format("{} {}", group.keys.front().Text("mechanism"), ToString(group.task.column));
  return piece;
}

/// The child's side: all records, one a line.
std::string Answer(const Piece& piece) {
  if (const auto garbage = PlantedFault(piece.owed.front())) return *garbage;
  std::string text;
  for (const Record& record : piece.work()) text += ToJsonLine(record) + '\n';
  return text;
}

/// The parent's side: what the piece owes, filled from the answer or with the reason why not.
std::vector<Record> Records(const Piece& piece, const ProcessResult& result,
                            const std::string& set) {
  std::vector<Record> records;
  std::string outcome(OutcomeOf(result.ending)), message = result.text;
  if (result.ending == ProcessEnding::kThrew) message = "threw: " + message;
  if (result.ending == ProcessEnding::kAnswered) {
    outcome = "bad-answer";
    message = "its process answered what is not its record";
    try {
      for (std::size_t start = 0; start < result.text.size();) {
        const std::size_t end = std::min(result.text.find('\n', start), result.text.size());
        records.push_back(FromJsonLine(std::string_view(result.text).substr(start, end - start)));
        start = end + 1;
      }
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

/// Runs the pieces the store does not have, or that are to be run again.
class Runner {
 public:
  Runner(const std::vector<Experiment>& experiments, const SuiteOptions& options,
         const std::vector<Record>& records, ResultStore& store)
      : options_(options), store_(store), estimate_(experiments, kForProgress) {
    for (const Record& record : records) {
      outcomes_[record.Text("id")] = record.Text("outcome");
    }
  }

  /// `pieces` in the order of the experiments.
  void Run(const std::string& what, std::vector<Piece> pieces, int jobs) {
    // a case that two files share is one case
    std::erase_if(pieces, [this](const Piece& piece) {
      bool asked_before = true;
      for (const Record& owed : piece.owed) {
        const std::string id = RunId(owed);
        if (!asked_.insert(id).second) continue;
        asked_before = false;
        count_.ids.push_back(id);
      }
      return asked_before;
    });
    std::ranges::stable_sort(pieces, std::greater<>(), &Piece::cost);
    std::erase_if(pieces, [this](const Piece& piece) {
      if (!Done(piece)) return false;
      count_.skipped += piece.owed.size();
      return true;
    });
    if (pieces.empty()) return;
    Progress progress(what, Foreseen(pieces), jobs);
    RunInProcesses(
        pieces.size(), jobs,
        [&](std::size_t i) {
          store_.LeaveToParent();
          return Answer(pieces[i]);
        },
        [&](std::size_t i) { return pieces[i].limits; },
        [&](std::size_t i, const ProcessResult& result) {
          if (!pieces[i].trajectory.empty()) RemovePart(pieces[i].trajectory);
          for (const Record& record : Records(pieces[i], result, options_.set)) {
            store_.Append(record);
            ++count_.run;
            count_.failed += record.Text("outcome") != ToString(Outcome::kFinished);
          }
          progress.Done(i);
        },
        {.started = [&](std::size_t i) { progress.Start(i); }, .waited = [&] { progress.Look(); }});
  }

  const SuiteCount& count() const { return count_; }

 private:
  bool Done(const Piece& piece) const {
    if (options_.rerun == Rerun::kAll) return false;
    if (!piece.product.empty() && !std::filesystem::exists(piece.product)) return false;
    return std::ranges::all_of(piece.owed, [this](const Record& owed) {
      const auto at = outcomes_.find(RunId(owed));
      return at != outcomes_.end() &&
             (options_.rerun == Rerun::kNone || at->second == ToString(Outcome::kFinished));
    });
  }

  /// Pilots run only where somebody sees what they are for.
  std::vector<Progress::Piece> Foreseen(const std::vector<Piece>& pieces) {
    std::vector<Progress::Piece> foreseen;
    for (const Piece& piece : pieces) {
      foreseen.push_back({piece.label, Progress::IsSeen()
                                           ? piece.seconds(estimate_)
                                           : std::numeric_limits<double>::quiet_NaN()});
    }
    return foreseen;
  }

  const SuiteOptions& options_;
  ResultStore& store_;
  Estimate estimate_;
  std::map<std::string, std::string> outcomes_;  ///< by id, the last one
  std::set<std::string> asked_;                  ///< ids
  SuiteCount count_;
};

/// Limits of time are of CPU time, so that too many jobs change no outcome. They gain nothing.
void WarnOfJobs(int jobs, const std::vector<Experiment>& experiments) {
  const int processors = ReadMachineState().processors;
  int threads = 1;
  for (const Experiment& experiment : experiments) {
    for (const Column& column : experiment.columns) threads = std::max(threads, column.threads);
  }
  if (threads > 1 && jobs * threads > processors) {
    PrintError(
        "warning: --jobs {} of up to {} threads on {} processor{}: they wait for each other\n",
        jobs, threads, processors, processors == 1 ? "" : "s");
  }
  if (jobs <= processors) return;
  PrintError(
      "warning: --jobs {} on {} processor{}: the runs take turns, and together they may ask "
      "for {} times the memory of one\n",
      jobs, processors, processors == 1 ? "" : "s", jobs);
}

}  // namespace

std::vector<Case> SelectCases(const Experiment& experiment, const Selection& filter) {
  std::vector<Case> cases = Expand(experiment);
  std::erase_if(cases, [&](const Case& one) { return !Matches(one.keys, filter); });
  if (cases.empty()) {
    throw ConfigError(
        fmt::format("{}: no case matches {}", experiment.path.string(), ToText(filter)));
  }
  return cases;
}

ProcessLimits LimitsOfRuns(const Limits& limits, double runs) {
  return {.cpu_s = kPatience * runs * limits.cpu_s + kGrace_s, .memory_mb = limits.memory_mb};
}

Shard ParseShard(const std::string& text) {
  Shard shard;
  const char* const end = text.data() + text.size();
  const auto index = std::from_chars(text.data(), end, shard.index);
  const bool has_count = index.ec == std::errc() && index.ptr != end && *index.ptr == '/';
  const auto count = has_count ? std::from_chars(index.ptr + 1, end, shard.count) : index;
  if (!has_count || count.ec != std::errc() || count.ptr != end || shard.index < 1 ||
      shard.index > shard.count) {
    throw ConfigError(fmt::format("--shard: found \"{}\", expected k/n with 1 <= k <= n <= {}",
                                  text, std::numeric_limits<int>::max()));
  }
  return shard;
}

SuiteCount RunSuite(const std::vector<Experiment>& experiments, const SuiteOptions& options,
                    const std::vector<Record>& records, ResultStore& store) {
  WarnOfJobs(options.jobs, experiments);
  RemoveParts(store.file());
  const Interruption interruption;
  Runner runner(experiments, options, records, store);
  std::vector<Piece> pieces;
  std::size_t number = 0;
  const auto add = [&](std::size_t e, auto make_piece, auto seconds) {
    if (!options.shard.Takes(number++)) return;
    pieces.push_back(make_piece());
    pieces.back().experiment = static_cast<std::int64_t>(e);
    pieces.back().seconds = seconds;
  };
  const auto run = [&](const std::string& what, int jobs) {
    runner.Run(what, std::exchange(pieces, {}), jobs);
    number = 0;
  };
  if (options.accuracy) {
    KeepMechanisms(experiments, store.file());
    std::vector<Piece> references;
    for (std::size_t e = 0; e < experiments.size(); ++e) {
      for (const Case& one : SelectCases(experiments[e], options.filter)) {
        add(
            e,
            [&] {
              if (HasReference(experiments[e], one)) {
                const ReferenceCase reference = ReferenceOf(experiments[e], one, store.file());
                references.push_back(ReferencePiece(experiments[e], reference));
                references.back().experiment = static_cast<std::int64_t>(e);
                references.back().seconds = [e, reference](Estimate& estimate) {
                  return estimate.OfReference(e, reference);
                };
              }
              return AccuracyPiece(experiments[e], Identified(experiments[e], one), store.file());
            },
            [e, one](Estimate& estimate) { return estimate.OfCase(e, one); });
      }
    }
    runner.Run("references", std::move(references), options.jobs);
    run("accuracy", options.jobs);
  }
  if (options.precision) {
    std::vector<std::vector<LadderGroup>> ladders;  // pieces refer to them
    for (const Experiment& experiment : experiments) {
      ladders.push_back(LadderGroups(experiment, options.filter));
    }
    for (std::size_t e = 0; e < experiments.size(); ++e) {
      for (const LadderGroup& ladder : ladders[e]) {
        add(
            e, [&] { return LadderPiece(experiments[e], ladder); },
            [e, &ladder](Estimate& estimate) { return estimate.OfLadder(e, ladder); });
      }
    }
    run("precision", options.jobs);
  }
  if (options.timing) {
    std::vector<std::vector<TimingGroup>> groups;  // pieces refer to them
    for (const Experiment& experiment : experiments) groups.push_back(TimingGroups(experiment));
    for (std::size_t e = 0; e < experiments.size(); ++e) {
      for (const TimingGroup& group : groups[e]) {
        add(
            e, [&] { return TimingPiece(experiments[e], group); },
            [e, &group](Estimate& estimate) { return estimate.OfTiming(e, group); });
      }
    }
    run("timing", 1);
  }
  return runner.count();
}

}  // namespace loopbench::harness
