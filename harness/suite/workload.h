// The cases of a run: parts, sweeps of any length, the whole.
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

// One part of a run, for as many machines.

/// One of `count` parts: every case is in exactly one.
struct Shard {
  int index = 1, count = 1;
  bool Takes(std::size_t number) const {
    return number % static_cast<std::size_t>(count) == static_cast<std::size_t>(index - 1);
  }
};

/// Reads "k/n" with 1 <= k <= n. Throws ConfigError.
Shard ParseShard(const std::string& text);

// A sweep of so many combinations that they are never held at once.
//
// What a file holds is told from some of its combinations: those in which each value of each axis
// occurs, which are read when the sweep is opened, so that a value that cannot be is refused before
// anything runs. What depends on several values together is refused where it is met.

/// Sweeps of more combinations are long: they are read in groups, run group after group, and
/// sharded by combination, so that a shard reads none but its own.
inline constexpr std::size_t kLongSweep = 1000;

/// Experiment files and what is changed and chosen of them.
struct ExperimentFiles {
  std::vector<std::filesystem::path> paths;
  std::vector<Setting> settings;
  Selection filter;
  int threads = 0;  ///< of all columns; 0: as the files say
};

/// The cases of a scene and column, over all combinations.
struct CaseLine {
  std::string mechanism, column;
  std::size_t cases = 0, runs = 0;  ///< an ensemble comes on top of the unperturbed run
};

/// Number of runs that the case is.
std::size_t RunsOf(const Case& one);

/// Adds a case, `times` over, to its line; lines stand in the order of their first case.
void AddTo(std::vector<CaseLine>* lines, const Case& one, std::size_t times = 1);

/// Throws ConfigError for a condition on a key that no case has: it would silently match nothing.
void RequireKeys(const std::vector<Experiment>& experiments, const Selection& filter);

/// Whether a case of the experiment passes.
bool Passes(const Experiment& experiment, const Selection& filter);

class LongSweep {
 public:
  /// Throws ConfigError as the reader does, for all that is read, and when no case can pass.
  LongSweep(ExperimentSource source, const ExperimentFiles& files);

  const ExperimentSource& source() const { return source_; }
  std::size_t count() const { return source_.count(); }

  /// Combinations spread evenly over all, at most 64, with at least one case that passes each.
  const std::vector<Experiment>& some() const { return some_; }

  /// Number of combinations in a group: fewer where mechanisms are large.
  std::size_t group_size() const { return group_size_; }

  /// Those of the combinations from..to-1 of a shard (its first, second, ...) that have cases which
  /// pass, with their numbers in the sweep.
  std::vector<Experiment> Read(std::size_t from, std::size_t to, const Shard& shard,
                               std::vector<std::int64_t>* numbers = nullptr);

  /// All cases that pass. Takes a microsecond or two for a combination where all have the same
  /// cases but for their parameters; else each is read.
  std::vector<CaseLine> CountCases();

 private:
  /// Nothing when no case passes.
  std::vector<Experiment> ReadOne(std::size_t combination);
  bool ParametersPass(std::size_t combination) const;
  std::vector<CaseLine> CountAlike(const Experiment& first) const;

  ExperimentSource source_;
  Selection filter_, on_axes_;  ///< all conditions, and those on parameters alone
  int threads_;
  bool are_alike_ = true;  ///< keys of cases differ in parameters only
  std::vector<Experiment> some_;
  std::size_t group_size_ = kLongSweep;
};

// What a command is asked to run: the experiments of its files, a group at a time.

/// Experiments that are in memory together.
struct ExperimentGroup {
  std::vector<Experiment> experiments;
  std::vector<std::int64_t> numbers;  ///< of each among all experiments of the command
  std::string name;                   ///< "combinations 1 to 1000 of 1000000", "" for all there is
  bool is_sharded = false;            ///< these are the shard's own; else its cases are chosen yet
};

/// Files without long sweeps are one group, as every command has it. A long sweep comes in groups
/// of its own, behind them.
class Workload {
 public:
  /// Reads all files but what long sweeps hold. Throws ConfigError as the readers do, and when no
  /// case of a file passes the filter.
  explicit Workload(const ExperimentFiles& files, const Shard& shard = {});

  bool is_long() const { return !sweeps_.empty(); }
  /// The first experiment of the first file.
  const Experiment& first() const { return *first_; }
  /// All experiments of short files, and some of each long sweep.
  const std::vector<Experiment>& some() const { return is_long() ? some_ : whole_.experiments; }

  std::size_t groups() const;
  ExperimentGroup Read(std::size_t group);

  /// Changes with all that decides which case is in which group.
  const std::string& content() const { return content_; }

 private:
  struct Part {
    LongSweep sweep;
    std::size_t groups;
    std::int64_t first_number;
  };

  Shard shard_;
  std::optional<Experiment> first_;
  ExperimentGroup whole_;         ///< all of the short files
  std::vector<Experiment> some_;  ///< where there are long sweeps
  std::vector<Part> sweeps_;
  std::string content_;
};

/// A file as those commands see it that run nothing.
struct Overview {
  std::vector<Experiment> experiments;  ///< all that have a case which passes, or some of them
  bool is_sample = false;               ///< some: of a long sweep
  std::size_t combinations = 0;         ///< that have such a case; of a long sweep all
  std::vector<std::pair<std::string, std::size_t>> axes;  ///< with their numbers of values
  std::vector<CaseLine> lines;                            ///< of all cases that pass

  std::size_t cases() const;
};

/// Throws ConfigError as Workload does.
Overview MakeOverview(const std::filesystem::path& path, const ExperimentFiles& files);

}  // namespace loopbench::harness
