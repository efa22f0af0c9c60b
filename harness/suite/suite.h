// Runs of experiments: groups of cases, stores, and files next to them.
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

// Runs the cases of experiments in child processes and stores their records.

/// Selects cases of the store to run again.
enum class Rerun { kNone, kFailed, kAll };

struct SuiteOptions {
  int jobs = 1;  ///< accuracy cases at once; timing always runs alone
  bool accuracy = true;
  bool timing = true;
  bool precision = true;  ///< ladders of several scalars
  Selection filter;       ///< accuracy cases and ladders whose keys do not match are left out
  Shard shard;
  bool isolate = false;  ///< run even short cases in a process of their own
  std::string set;       ///< changes by --set, stored in the records as text
  Rerun rerun = Rerun::kNone;
};

/// Returns the accuracy cases that pass the filter. Throws ConfigError if none does.
std::vector<Case> SelectCases(const Experiment& experiment, const Selection& filter);

/// Returns limits for a process with `runs` runs, each multiplied by its threads: twice the CPU
/// time of the single runs, plus a little for starting.
ProcessLimits LimitsOfRuns(const Limits& limits, double runs);

/// Counts of a suite run.
struct SuiteCount {
  std::size_t run = 0;                    ///< new records
  std::size_t skipped = 0;                ///< cases already in the store
  std::size_t failed = 0;                 ///< new records with any outcome but "finished"
  std::size_t pieces = 0, processes = 0;  ///< number of new pieces; short pieces share processes
  /// Ids of all requested cases, new or stored: by kind, then in the order of the experiments.
  /// Empty after a long sweep.
  std::vector<std::string> ids;
};

/// Makes the references for the accuracy cases of all experiments, then runs these cases (most
/// expensive first), the precision ladders and the timings. Shows progress. Stores each record as
/// soon as it is complete. Long sweeps repeat all of this for each group, kind by kind.
///
/// A case is done if the store has a record with its id. The id represents all settings of the run
/// and this very program. `finished` contains the records in the store at the call. Completed
/// groups of long sweeps are marked next to the store and not read again.
///
/// Throws Interrupted (harness/isolation/processes.h) on Ctrl-C; complete records are then in the
/// store.
///
/// Every case gets a record: outcomes "crashed", "process-time-limit", "memory-limit" and
/// "invalid-result" come from its process. Short cases share processes
/// (harness/isolation/processes.h).
SuiteCount RunSuite(Workload& workload, const SuiteOptions& options, FinishedRuns& finished,
                    ResultStore& store);

// Files next to a store for later display of motions: the mechanisms of its problems, as files that
// every command reads, and their references.

/// Returns mechanisms/ID.json next to a store's `file`, where ID is the "problem_id" of the record;
/// empty without an id, or for an id that no run writes.
std::filesystem::path MechanismOf(const Record& record, const std::filesystem::path& store_file);

/// Returns the text of such a file with the checksum of its other bytes in its comment; other texts
/// stay.
std::string WithOwnHash(std::string text);

/// Reads such a file. Throws ChangedFile (trajectory/store_files.h) if its checksum is wrong, and
/// as ReadMechanism().
MechanismDescription ReadKeptMechanism(const std::filesystem::path& file);

/// Throws ChangedFile if a mechanism or trajectory next to a store's `file` was changed after its
/// run wrote it. Missing files are valid.
void VerifyFilesOf(const std::vector<Record>& records, const std::filesystem::path& store_file);

/// Writes missing mechanism files for all problems with stored motion (references or trajectories).
/// Omits mechanisms with parts of other programs, which files cannot express.
void KeepMechanisms(const std::vector<Experiment>& experiments,
                    const std::filesystem::path& store_file);

/// Returns the reference of a record, next to the store's `file`; empty if it has none.
std::filesystem::path ReferenceOf(const Record& record, const std::filesystem::path& store_file);

/// Copies each mechanism of `records` completely from the first of `stores` that has it to the
/// folder of `target`.
void CopyMechanisms(const std::vector<Record>& records,
                    const std::vector<std::filesystem::path>& stores,
                    const std::filesystem::path& target);

}  // namespace loopbench::harness
