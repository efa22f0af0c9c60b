// Cases of a run: shards, sweeps of any length, the whole.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "harness/config/experiment_reader.h"
#include "harness/record/select.h"

namespace loopbench::harness {

// Shards divide a run among several machines.

/// One of `count` shards: every case is in exactly one.
struct Shard {
  int index = 1, count = 1;
  bool Takes(std::size_t number) const {
    return number % static_cast<std::size_t>(count) == static_cast<std::size_t>(index - 1);
  }
};

/// Reads "k/n" with 1 <= k <= n. Throws ConfigError.
Shard ParseShard(const std::string& text);

// A sweep with too many combinations to hold in memory at once.
//
// Opening a sweep reads enough combinations to contain each value of each axis. Invalid values are
// therefore rejected before anything runs. Invalid combinations of values are rejected when they
// are reached.

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

/// Adds a case `times` times to its line; lines are in the order of their first case.
void AddTo(std::vector<CaseLine>* lines, const Case& entry, std::size_t times = 1);

/// Throws ConfigError for a condition on a key that no case has, since it would match nothing.
void RequireKeys(const std::vector<Experiment>& experiments, const Selection& filter);

/// Returns true if any case of the experiment passes.
bool Passes(const Experiment& experiment, const Selection& filter);

class LongSweep {
 public:
  /// Throws ConfigError as the reader, for all combinations read here, and if no case can pass.
  LongSweep(ExperimentSource source, const ExperimentFiles& files);

  const ExperimentSource& source() const { return source_; }
  std::size_t count() const { return source_.count(); }

  /// Returns evenly spaced combinations, at most 64, each with at least one passing case.
  const std::vector<Experiment>& some() const { return some_; }

  /// Returns the number of combinations in a group: fewer for large mechanisms.
  std::size_t group_size() const { return group_size_; }

  /// Reads combinations from..to-1 of a shard (its first, second, ...) that have passing cases,
  /// with their numbers in the sweep.
  std::vector<Experiment> Read(std::size_t from, std::size_t to, const Shard& shard,
                               std::vector<std::int64_t>* numbers = nullptr);

  /// Counts all passing cases. Takes a microsecond or two per combination if cases differ only in
  /// parameters; otherwise reads each combination.
  std::vector<CaseLine> CountCases();

 private:
  /// Returns nothing if no case passes.
  std::vector<Experiment> ReadOne(std::size_t combination);
  bool ParametersPass(std::size_t combination) const;
  std::vector<CaseLine> CountAlike(const Experiment& first) const;

  ExperimentSource source_;
  Selection filter_, on_axes_;  ///< all conditions, and those on parameters only
  int threads_;
  bool are_alike_ = true;  ///< keys of cases differ in parameters only
  std::vector<Experiment> some_;
  std::size_t group_size_ = kLongSweep;
};

// Work of a command: the experiments of its files, a group at a time.

/// Experiments in memory at the same time.
struct ExperimentGroup {
  std::vector<Experiment> experiments;
  std::vector<std::int64_t> numbers;  ///< index of each among all experiments of the command
  std::string name;                   ///< "combinations 1 to 1000 of 1000000", or ""
  bool is_sharded = false;            ///< true: selected for the shard already
};

/// Short files form one group. Long sweeps follow in groups of their own.
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
  struct Part {
    LongSweep sweep;
    std::size_t groups;
    std::int64_t first_number;
  };

  Shard shard_;
  std::optional<Experiment> first_;
  ExperimentGroup whole_;         ///< all short files
  std::vector<Experiment> some_;  ///< samples, if there are long sweeps
  std::vector<Part> sweeps_;
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

}  // namespace loopbench::harness
