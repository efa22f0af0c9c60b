#include "harness/suite/suite.h"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <set>
#include <sstream>
#include <string_view>
#include <unordered_set>
#include <utility>

#include "harness/base/record.h"
#include "harness/base/text.h"
#include "harness/config/mechanism_reader.h"
#include "harness/observers/reference.h"
#include "harness/observers/trajectory.h"
#include "harness/run/processes.h"
#include "harness/run/run.h"
#include "harness/run/timing.h"

namespace loopbench::harness {

namespace {

/// Small budget, because the user waits for the pilots before the first case. Groups of a long
/// sweep are extrapolated from the first one.
constexpr Estimate::Budget kForProgress = {
    .share = 0.01, .least_s = 0.003, .most_s = 0.25, .all_s = 2.0};

Estimate::Budget ForProgress(double pilots_s) {
  Estimate::Budget budget = kForProgress;
  budget.all_s = pilots_s;
  return budget;
}

/// Warns about more jobs than processors: time limits count CPU time, so outcomes do not change.
void WarnOfJobs(int jobs, const std::vector<Experiment>& experiments) {
  const int processors = ReadMachineState().processors;
  int threads = 1;
  for (const Experiment& experiment : experiments) {
    for (const Method& method : experiment.methods) threads = std::max(threads, method.threads);
  }
  if (threads > 1 && jobs * threads > processors) {
    PrintError(
        "warning: --jobs {} of up to {} threads on {} processor{}: they wait for each other\n",
        jobs, threads, processors, processors == 1 ? "" : "s");
  }
  if (jobs <= processors) return;
  PrintError(
      "warning: --jobs {} on {} processor{}: the runs share processors, and together may use {} "
      "times the memory of one\n",
      jobs, processors, processors == 1 ? "" : "s", jobs);
}

/// Pieces of one group, kind by kind.
class Group {
 public:
  Group(const ExperimentGroup& group, const SuiteOptions& options, double pilots_s, Runner* runner,
        ResultStore& store)
      : group_(group),
        experiments_(group.experiments),
        options_(options),
        runner_(runner),
        store_(store),
        estimate_(experiments_, ForProgress(pilots_s), options.filter) {}

  /// Run all pieces of a kind; return the number of records of runs that did not finish.
  std::size_t Accuracy() {
    KeepMechanisms(experiments_, store_.file());
    std::vector<Piece> references;
    for (std::size_t e = 0; e < experiments_.size(); ++e) {
      for (const Case& entry : SelectCases(experiments_[e], options_.filter)) {
        Piece piece =
            AccuracyPiece(experiments_[e], Identified(experiments_[e], entry), store_.file());
        const bool is_taken = Add(e, std::move(piece), [e, entry](Estimate& estimate) {
          return estimate.OfCase(e, entry);
        });
        if (!is_taken || !HasReference(experiments_[e], entry)) continue;
        const ReferenceCase reference = ReferenceOf(experiments_[e], entry, store_.file());
        references.push_back(ReferencePiece(experiments_[e], reference));
        references.back().experiment = group_.numbers[e];
        references.back().seconds = [e, reference](Estimate& estimate) {
          return estimate.OfReference(e, reference);
        };
      }
    }
    const std::size_t failed =
        runner_->Run(Named("references"), std::move(references), options_.jobs, false, &estimate_);
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
  template <class Seconds>
  bool Add(std::size_t e, Piece piece, Seconds seconds) {
    if (!group_.is_sharded) {
      bool is_new = false;
      for (const Record& owed : piece.owed) is_new |= dealt_.insert(RunId(owed)).second;
      if (!is_new || !options_.shard.Takes(number_++)) return false;
    }
    piece.experiment = group_.numbers[e];
    piece.seconds = seconds;
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
    return runner_->Run(Named(what), std::exchange(pieces_, {}), jobs, shared, &estimate_);
  }

  std::string Named(const char* what) const {
    return group_.name.empty() ? what : fmt::format("{}, {},", what, group_.name);
  }

  const ExperimentGroup& group_;
  const std::vector<Experiment>& experiments_;
  const SuiteOptions& options_;
  Runner* runner_;
  ResultStore& store_;
  Estimate estimate_;
  std::vector<Piece> pieces_;
  std::size_t number_ = 0;                 ///< number of the next piece, for sharding
  std::unordered_set<std::string> dealt_;  ///< ids of the pieces of all shards
};

// Marks of completed groups of a long sweep, next to the store: a resumed run need not read a
// million combinations that are done.
//
// A mark is a line of results.groups with content (Workload::content()), kind, group, number of
// records, number of unfinished runs, and state of the store. The state is its length and a hash of
// its last bytes. A mark is valid only while the store up to that length is unchanged. The marks
// are a cache; deleting them is safe.

constexpr std::uintmax_t kLast = 512;  ///< bytes, within a record with its checksum

/// Returns the hash of the bytes before `end`, "" if they cannot be read.
std::string HashBefore(std::ifstream& store, std::uintmax_t end) {
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
  double pilots_s = kForProgress.all_s;
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
      Group group(experiments, options, pilots_s, &runner, store);
      const std::size_t failed = (group.*kind.run)();
      if (!workload.is_long()) continue;
      marks.Add(kind.name, g, {runner.count.run + runner.count.skipped - before, failed});
      runner.Forget();
      pilots_s = 0.0;
    }
  }
  return runner.count;
}
namespace {

/// Returns true for file names as written by runs; records from other sources are not trusted.
bool IsId(const std::string& text) {
  return text.size() == 16 && text.find_first_not_of("0123456789abcdef") == std::string::npos;
}

std::filesystem::path MechanismPath(const std::filesystem::path& store_file,
                                    const std::string& problem_id) {
  return store_file.parent_path() / "mechanisms" / (problem_id + ".json");
}

/// Comment with the hash of all bytes of the file, computed with zeros in place of the hash.
constexpr std::string_view kChecksum = "Kept by a run; checksum ", kZeros = "0000000000000000";

}  // namespace

std::string WithOwnHash(std::string text) {
  const std::size_t at = text.find(kChecksum);
  if (at == std::string::npos) return text;  // format version 1.0
  text.replace(at + kChecksum.size(), kZeros.size(), kZeros);
  return text.replace(at + kChecksum.size(), kZeros.size(), Fnv1a(text));
}

namespace {

void VerifyMechanism(const std::filesystem::path& file) {
  if (const std::string text = ReadFile(file); WithOwnHash(text) == text) return;
  throw ChangedFile(
      fmt::format("{}: the file was changed after its run wrote it: its checksum differs; remove "
                  "it: the same run writes it again",
                  file.string()));
}

}  // namespace

MechanismDescription ReadKeptMechanism(const std::filesystem::path& file) {
  VerifyMechanism(file);
  return ReadMechanism(file).description;
}

void VerifyFilesOf(const std::vector<Record>& records, const std::filesystem::path& store_file) {
  std::set<std::filesystem::path> verified;
  for (const Record& record : records) {
    const std::filesystem::path mechanism = MechanismOf(record, store_file);
    const std::filesystem::path trajectory = TrajectoryOf(record, store_file);
    if (std::filesystem::exists(mechanism) && verified.insert(mechanism).second) {
      VerifyMechanism(mechanism);
    }
    if (std::filesystem::exists(trajectory)) VerifyTrajectory(record, trajectory);
  }
}

std::filesystem::path MechanismOf(const Record& record, const std::filesystem::path& store_file) {
  const std::string id = record.Text("problem_id");
  return IsId(id) ? MechanismPath(store_file, id) : std::filesystem::path();
}

std::filesystem::path ReferenceOf(const Record& record, const std::filesystem::path& store_file) {
  const std::string id = record.Text("reference_file");
  return IsId(id) ? ReferencePath(store_file, id) : std::filesystem::path();
}

void KeepMechanisms(const std::vector<Experiment>& experiments,
                    const std::filesystem::path& store_file) {
  for (const Experiment& experiment : experiments) {
    if (!experiment.reference && !experiment.output) continue;
    for (const ExperimentProblem& problem : experiment.problems) {
      const auto path = MechanismPath(store_file, Fnv1a(problem.mechanism.canonical));
      if (std::filesystem::exists(path)) continue;
      try {
        WriteFileAtomically(path, WithOwnHash(MechanismText(
                                      problem.mechanism.description, problem.mechanism.observe,
                                      fmt::format("{}{}.", kChecksum, kZeros))));
      } catch (const ConfigError&) {
      }
    }
  }
}

void CopyMechanisms(const std::vector<Record>& records,
                    const std::vector<std::filesystem::path>& stores,
                    const std::filesystem::path& target) {
  for (const Record& record : records) {
    const std::filesystem::path to = MechanismOf(record, target);
    if (to.empty() || std::filesystem::exists(to)) continue;
    for (const std::filesystem::path& store : stores) {
      const std::filesystem::path from = MechanismOf(record, store);
      if (!std::filesystem::exists(from)) continue;
      const std::string text = ReadFile(from);
      if (WithOwnHash(text) != text) continue;
      WriteFileAtomically(to, text);
      break;
    }
  }
}

}  // namespace loopbench::harness
