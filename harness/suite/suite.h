// A run of an experiment: groups of cases, stores, and the files beside them.
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "harness/config/experiment.h"
#include "harness/isolation/processes.h"
#include "harness/record/record.h"
#include "harness/record/select.h"
#include "harness/store/result_store.h"
#include "harness/suite/workload.h"

namespace loopbench::harness {

// Runs the cases of experiments in processes of their own, and keeps their records.

/// Which of the cases that a store already has are run again.
enum class Rerun { kNone, kFailed, kAll };

struct SuiteOptions {
  int jobs = 1;  ///< accuracy cases at once; timing always runs alone
  bool accuracy = true;
  bool timing = true;
  bool precision = true;  ///< ladders of several scalars
  Selection filter;       ///< accuracy cases and ladders whose keys do not match are left out
  Shard shard;
  bool isolate = false;  ///< every case in a process of its own, however short
  std::string set;       ///< what --set changed, kept in the records for people to read
  Rerun rerun = Rerun::kNone;
};

/// The accuracy cases that pass the filter. Throws ConfigError when none does.
std::vector<Case> SelectCases(const Experiment& experiment, const Selection& filter);

/// Those of a process that makes so many runs, each counted once for each of its threads: twice the
/// CPU time that they may take by themselves, and a little for starting.
ProcessLimits LimitsOfRuns(const Limits& limits, double runs);

/// What a run did.
struct SuiteCount {
  std::size_t run = 0;                    ///< records made now
  std::size_t skipped = 0;                ///< cases the store had already
  std::size_t failed = 0;                 ///< of those made now: any outcome but "finished"
  std::size_t pieces = 0, processes = 0;  ///< of what was run; short pieces share processes
  /// Of every case that was asked for, run now or done before: kind after kind, each in the order
  /// of the experiments. Empty after a long sweep.
  std::vector<std::string> ids;
};

/// Makes the references that the accuracy cases of all experiments ask for, runs these cases,
/// costliest first, then the precision ladders, then the timings, and shows progress. Each record
/// goes to the store as soon as it is complete. Long sweeps go through all of that group by group,
/// kind after kind.
///
/// A case is done when the store has a record with its id. The id stands for everything that
/// decides the run and for this very program. `finished` is what the store has when the call
/// begins. Groups of long sweeps that are done are marked beside the store (suite.h), and not
/// read again.
///
/// Throws Interrupted (harness/isolation/processes.h) on Ctrl-C; what is complete by then is in
/// the store.
///
/// Whatever a case does, it gets a record: outcomes "crashed", "process-time-limit", "memory-limit"
/// and "invalid-result" are those of its process. Short cases share processes
/// (harness/isolation/processes.h).
SuiteCount RunSuite(Workload& workload, const SuiteOptions& options, FinishedRuns& finished,
                    ResultStore& store);

// Which groups of a long sweep are done, beside the store: so that a run that goes on need not read
// a million combinations to find that it has them.
//
// A mark is a line of results.groups: what is run (Workload::content()), the kind, the group, how
// many records, how many of runs that did not finish, and what the store was when it was made: its
// length and a hash of its last bytes. A store that is not what it was then, in front of that
// length, has no such mark: the store is the truth, and whoever deletes the marks loses only time.

struct GroupMark {
  std::size_t records = 0, failed = 0;
};

class GroupMarks {
 public:
  /// Reads the marks of this content that hold for the store.
  /// @param store  its file
  GroupMarks(const std::filesystem::path& store, std::string content);

  std::optional<GroupMark> Find(const std::string& kind, std::size_t group) const;

  /// Says that all records of the group are in the store. A mark that cannot be written is
  /// forgotten.
  void Add(const std::string& kind, std::size_t group, const GroupMark& mark);

 private:
  std::filesystem::path store_, file_;
  std::string content_;
  std::map<std::pair<std::string, std::size_t>, GroupMark> marks_;
};

// What a store keeps beside its lines so that motions can be looked at later: the mechanisms of its
// scenes, as files that every command reads, and their references.

/// mechanisms/ID.json beside a store's `file`, ID being the record's "problem_id"; empty where it
/// has none, or one that no run has written.
std::filesystem::path MechanismOf(const Record& record, const std::filesystem::path& store_file);

/// Reads such a file. Throws ChangedFile (trajectory/store_files.h) if its checksum is wrong, and
/// as ReadMechanism() does.
MechanismDescription ReadKeptMechanism(const std::filesystem::path& file);

/// Writes those of all scenes whose motion is kept, in a reference or in trajectories, and that are
/// not there yet. A mechanism that no file can say (parts of other programs) is left out.
void KeepMechanisms(const std::vector<Experiment>& experiments,
                    const std::filesystem::path& store_file);

/// The reference of a record, beside the store's `file`; empty where the record has none.
std::filesystem::path ReferenceOf(const Record& record, const std::filesystem::path& store_file);

/// Copies the mechanisms of `records` from the first of the `stores` that has them to beside
/// `target`, each whole or not at all.
void CopyMechanisms(const std::vector<Record>& records,
                    const std::vector<std::filesystem::path>& stores,
                    const std::filesystem::path& target);

}  // namespace loopbench::harness
