// Runs of experiments: workloads, estimates, references, stores.
#pragma once

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "harness/base/record.h"
#include "harness/base/store.h"
#include "harness/base/text.h"
#include "harness/config/experiment.h"
#include "harness/config/experiment_reader.h"
#include "harness/observers/reference.h"
#include "harness/precision/ladder.h"
#include "harness/run/processes.h"
#include "harness/run/timing.h"

namespace loopbench::harness {

// Precision ladders of an experiment (harness/precision/ladder.h): one per problem and method.

/// A ladder and the keys of its records: the reference, then every rung in the order of
/// Ladder::rungs (kind "precision", with case_id and content).
struct LadderGroup {
  LadderTask task;  ///< without the description, which the child process makes
  std::size_t problem = 0;
  std::vector<Record> keys;

  double runs() const { return static_cast<double>(keys.size() + 1); }  ///< two references
};

/// Returns the groups that contain a rung passing the filter.
std::vector<LadderGroup> LadderGroups(const Experiment& experiment, const Selection& filter = {});

/// Returns the number of records of all groups.
std::size_t CountRungs(const Experiment& experiment);

/// Throws ConfigError for a problem that a ladder cannot run: not planar after compilation, or with
/// time tables. Compiles problems in a child process under the experiment's limits. A problem that
/// exceeds these limits is not rejected here.
void CheckLadders(const Experiment& experiment);

/// Calls CheckLadders(). Without LOOPBENCH_PRECISIONS, throws ConfigError for any ladder.
void RequireLadders(const Experiment& experiment);

/// Runs a ladder; returns one record per key, in order.
std::vector<Record> ClimbTogether(const Experiment& experiment, const LadderGroup& group);

/// Reference solution of a problem and horizon: a record, and a file if it is certified.
struct ReferenceCase {
  std::size_t problem = 0;
  double horizon = 0.0;  ///< [s]
  std::string id;
  std::filesystem::path file;  ///< empty for a published series
  Record keys;                 ///< of kind "reference", with case_id and content
};

/// Returns true if the case is compared with a certified reference or a published series.
bool HasReference(const Experiment& experiment, const Case& one);

/// Returns the reference of a case that has one.
/// @param store  the file of the store
ReferenceCase ReferenceOf(const Experiment& experiment, const Case& one,
                          const std::filesystem::path& store);

/// Integrations of a certified reference (harness/precision/make_reference.h).
inline constexpr double kWitnesses = 3.0;

/// Creates the file if needed and absent, and returns a record of the certified accuracy.
Record MakeOne(const Experiment& experiment, const ReferenceCase& one);

/// Reads the certified reference of the case; nothing if the experiment requests none. A failed
/// reference has no snapshots and contains the reason.
std::optional<Reference> FindReference(const Experiment& experiment, const Case& one,
                                       const std::filesystem::path& store);

/// Throws ConfigError if the experiment requests references and this program was built without
/// their scalars (LOOPBENCH_PRECISIONS).
void RequireReferences(const Experiment& experiment);

// Estimates the time of the pieces of a suite from pilots: the same work over a shorter horizon.

class TemporaryFolder;
struct PilotCost;

/// CPU times measured by pilots, and the extrapolation to the full horizon.
struct Rate {
  double process_s = 0.0;  ///< CPU time of an empty process [s]
  double fixed_s = 0.0;    ///< per run, independent of the horizon [s]
  double member = 1.0;     ///< CPU time of an ensemble member [relative to the unperturbed run]
  double running_s = 0.0;  ///< CPU time of the longest pilot, at its tolerance [s]
  double reached = 1.0;    ///< part covered by this pilot [of the horizon]
  double slope_s = 0.0;    ///< slope beyond it: CPU time of a whole horizon [s]
  double ends_at = 1.0;    ///< part at which a run failed, and will again [of the horizon]
  /// CPU time at which the step limit ends the run [s].
  double most_s = std::numeric_limits<double>::infinity();

  /// Returns the CPU time for a part of the horizon, without the fixed time [s].
  double Running(double part) const {
    const double to = std::min(part, ends_at);
    return std::min(
        most_s, to <= reached ? running_s * to / reached : running_s + slope_s * (to - reached));
  }
};

/// Pilots begin with 2 % of the horizon and grow until they have used `share` of the estimated time
/// of the piece, within bounds. The last two give the slope, since many runs begin with short
/// steps. Runs with equal problem, method and integrator share pilots at the loosest tolerance and,
/// unless they are short, at the finest. A power law interpolates between them. For a long sweep
/// eight combinations are tried. Each pilot runs in its own process under the limits of its case.
/// If these stop it, the case is assumed to end in the same way.
class Estimate {
 public:
  struct Budget {
    double share = 0.1, least_s = 0.003, most_s = 2.0;  ///< per pilot
    double usual_s = 4.0;  ///< all pilots [s]: beyond it each may use less than most_s
    double all_s = 1e9;    ///< wall time of all pilots [s]; later requests remain unknown
  };
  /// `experiments` must outlive this. Pilots use tolerances of cases that pass `filter`.
  Estimate(const std::vector<Experiment>& experiments, const Budget& budget,
           const Selection& filter = {})
      : experiments_(experiments), budget_(budget), filter_(filter) {}

  /// Returns the CPU time of a piece of the experiment [s], NaN if unknown. A case includes its
  /// unperturbed run and its ensemble, or, if timed, `simulations` runs in one process.
  double OfCase(std::size_t experiment, const Case& one, double simulations = 0.0);
  double OfReference(std::size_t experiment, const ReferenceCase& one);
  double OfLadder(std::size_t experiment, const LadderGroup& group);
  double OfTiming(std::size_t experiment, const TimingGroup& group);

  std::size_t pilots() const { return rates_.size(); }
  /// Returns a sentence for each pilot stopped by its limits.
  const std::vector<std::string>& cut_off() const { return cut_off_; }

 private:
  std::size_t Nearest(std::size_t experiment) const;
  const std::pair<double, double>& Tolerances(std::size_t experiment);
  const Rate* Known(const std::string& key, const std::string& name, const ProcessLimits& limits,
                    double times, const std::function<PilotCost(double fraction)>& work);
  std::filesystem::path PlaceForRows();
  const Rate* RateOfCase(std::size_t experiment, const Case& one, double rtol);

  const std::vector<Experiment>& experiments_;
  Budget budget_;
  Selection filter_;
  std::map<std::size_t, std::pair<double, double>> tolerances_;  ///< finest and loosest
  double spent_s_ = 0.0;
  std::shared_ptr<TemporaryFolder> written_;  ///< for trajectories of pilots
  std::map<std::string, Rate> rates_;
  std::vector<std::string> cut_off_;
};

/// Sentences about starts, from checks before any run: faults (not assembled, with found and
/// expected values) and warnings (initial guesses that are not met).
struct StartReport {
  std::vector<std::string> faults, warnings;
};

/// Assembles the mechanism in a child process; exceeding the limits is a fault.
StartReport CheckStart(const MechanismDescription& description, const ProcessLimits& limits);

/// Checks the problems of an experiment's combinations as they are run, under the limits of their
/// cases, up to the first combination with a fault. Shared problems are assembled once; members of
/// ensembles are not checked.
StartReport CheckStarts(const std::vector<Experiment>& experiments);

/// Throws ConfigError for mechanisms that do not have the degrees of freedom that their files
/// expect, analysed in a child process; exceeding the limits is an error, too.
void RequireFreedom(const MechanismFile& file, const ProcessLimits& limits);
void RequireFreedom(const std::vector<Experiment>& experiments);

// Cases of a run: shards, sweeps of any length, the whole.

/// One of `count` shards: every case is in exactly one.
struct Shard {
  int index = 1, count = 1;
  bool Takes(std::size_t number) const {
    return number % static_cast<std::size_t>(count) == static_cast<std::size_t>(index - 1);
  }
};

/// Reads "k/n" with 1 <= k <= n. Throws ConfigError.
Shard ParseShard(const std::string& text);

/// Maximum number of combinations of a short sweep. Longer ones are read and run in groups, and
/// sharded by combination: a shard reads only its own.
inline constexpr std::size_t kLongSweep = 1000;

/// Experiment files with their changed settings and selection.
struct ExperimentFiles {
  std::vector<std::filesystem::path> paths;
  std::vector<Setting> settings;
  Selection filter;
  int threads = 0;  ///< for all methods; 0: as in the files
};

/// Cases of a problem and method, over all combinations.
struct CaseLine {
  std::string mechanism, method;
  std::size_t cases = 0, runs = 0;  ///< an ensemble adds to the unperturbed run
};

/// Returns the number of runs of a case.
std::size_t RunsOf(const Case& entry);

/// Experiments in memory at the same time.
struct ExperimentGroup {
  std::vector<Experiment> experiments;
  std::vector<std::int64_t> numbers;  ///< index of each among all experiments of the command
  std::string name;                   ///< "combinations 1 to 1000 of 1000000", or ""
  bool is_sharded = false;            ///< true: selected for the shard already
};

class LongSweep;

/// Work of a command: the experiments of its files, a group at a time. Short files form one group.
/// Long sweeps follow in groups of their own.
class Workload {
 public:
  /// Reads all files except the combinations of long sweeps. Throws ConfigError as the readers, and
  /// if no case of a file passes the filter.
  explicit Workload(const ExperimentFiles& files, const Shard& shard = {});

  bool is_long() const { return !sweeps_.empty(); }
  /// Returns the first experiment of the first file.
  const Experiment& first() const { return *first_; }
  /// Returns all experiments of short files and samples of each long sweep.
  const std::vector<Experiment>& some() const { return is_long() ? some_ : whole_.experiments; }

  std::size_t groups() const;
  ExperimentGroup Read(std::size_t group);

  /// Returns a hash of everything that determines the cases of each group.
  const std::string& content() const { return content_; }

 private:
  std::optional<Experiment> first_;
  ExperimentGroup whole_;         ///< all short files
  std::vector<Experiment> some_;  ///< samples, if there are long sweeps
  /// Long sweeps, with the number of the first experiment of each.
  std::vector<std::pair<std::shared_ptr<LongSweep>, std::int64_t>> sweeps_;
  std::string content_;
};

/// Summary of a file for commands that run nothing.
struct Overview {
  std::vector<Experiment> experiments;  ///< experiments with a passing case, all or a sample
  bool is_sample = false;               ///< true for a sample of a long sweep
  std::size_t combinations = 0;         ///< number with a passing case; in a long sweep all
  std::vector<std::pair<std::string, std::size_t>> axes;  ///< with their numbers of values
  std::vector<CaseLine> lines;                            ///< all passing cases

  std::size_t cases() const;
};

/// Throws ConfigError as Workload.
Overview MakeOverview(const std::filesystem::path& path, const ExperimentFiles& files);

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
  /// Ids of all requested cases by kind and order in the experiments; empty after a long sweep.
  std::vector<std::string> ids;
};

/// Makes the references for the accuracy cases of all experiments, then runs these cases (most
/// expensive first), the precision ladders and the timings. Shows progress. Stores each record as
/// soon as it is complete. Long sweeps repeat all of this for each group, kind by kind.
///
/// A case is done if the store has a record with its id (all settings, and this very program).
/// `finished` contains the records in the store at the call. Completed groups of long sweeps are
/// marked next to the store and not read again. Every case gets a record: outcomes "crashed",
/// "process-time-limit", "memory-limit" and "invalid-result" come from its process.
///
/// Throws Interrupted (harness/run/processes.h) on Ctrl-C.
SuiteCount RunSuite(Workload& workload, const SuiteOptions& options, FinishedRuns& finished,
                    ResultStore& store);

// Files next to a store for later display of motions: mechanisms and references.

/// Returns mechanisms/ID.json next to a store's `file`, where ID is the "problem_id" of the record;
/// empty without an id, or for an id that no run writes.
std::filesystem::path MechanismOf(const Record& record, const std::filesystem::path& store_file);

/// Returns the text of such a file with its checksum in its comment; other texts stay.
std::string WithOwnHash(std::string text);

/// Reads such a file. Throws ChangedFile if its checksum is wrong, and as ReadMechanism().
MechanismDescription ReadKeptMechanism(const std::filesystem::path& file);

/// Throws ChangedFile if a run's mechanism or trajectory file was changed. It may be missing.
void VerifyFilesOf(const std::vector<Record>& records, const std::filesystem::path& store_file);

/// Writes missing mechanism files for all problems with stored motion (references or trajectories).
/// Omits mechanisms with parts of other programs, which files cannot express.
void KeepMechanisms(const std::vector<Experiment>& experiments,
                    const std::filesystem::path& store_file);

/// Returns the reference of a record, next to the store's `file`; empty if it has none.
std::filesystem::path ReferenceOf(const Record& record, const std::filesystem::path& store_file);

/// Copies each mechanism of `records` from the first of `stores` that has it to `target`.
void CopyMechanisms(const std::vector<Record>& records,
                    const std::vector<std::filesystem::path>& stores,
                    const std::filesystem::path& target);

// Progress line with the remaining time, on standard error if it is a terminal.

/// Shows the running pieces from the start. Silent if standard error is no terminal.
class Progress {
 public:
  /// A piece of work: label and estimated duration [s]; NaN: the average of the others is used.
  struct Piece {
    std::string label;
    double estimate_s;
  };

  /// Runs `jobs` pieces at once.
  Progress(std::string what, std::vector<Piece> pieces, int jobs);
  ~Progress();  ///< clears the line
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  static bool IsSeen();

  void Start(std::size_t piece);
  void Done(std::size_t piece);
  /// Redraws the line if a second has passed.
  void Look();

 private:
  struct Running {
    std::size_t piece;
    double begin;  ///< [s]
  };

  /// Returns the remaining time, corrected by the durations of finished pieces. Negative: unknown.
  double SecondsToGo() const;
  void Draw();

  std::string what_;
  std::vector<Piece> pieces_;
  int jobs_;
  bool is_seen_;
  std::size_t done_ = 0;
  double taken_s_ = 0.0, foreseen_s_ = 0.0;  ///< of the finished pieces
  double waiting_s_ = 0.0;                   ///< estimate for the pieces that have not begun
  std::vector<Running> running_;
  double begin_ = WallSeconds(), drawn_ = 0.0;  ///< [s]
};

}  // namespace loopbench::harness
