// Runs the cases of experiments in processes of their own, and keeps their records.
#pragma once

#include <string>
#include <vector>

#include "harness/config/experiment.h"
#include "harness/isolation/processes.h"
#include "harness/record/select.h"
#include "harness/store/finished_runs.h"
#include "harness/store/result_store.h"
#include "harness/suite/workload.h"

namespace loopbench::harness {

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
/// begins. Groups of long sweeps that are done are marked beside the store (group_marks.h), and not
/// read again.
///
/// Throws Interrupted (harness/isolation/interruption.h) on Ctrl-C; what is complete by then is in
/// the store.
///
/// Whatever a case does, it gets a record: outcomes "crashed", "process-time-limit", "memory-limit"
/// and "bad-answer" are those of its process. Short cases share processes
/// (harness/isolation/shared_processes.h).
SuiteCount RunSuite(Workload& workload, const SuiteOptions& options, FinishedRuns& finished,
                    ResultStore& store);

}  // namespace loopbench::harness
