// What a command is asked to run: the experiments of its files, a group at a time.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "harness/suite/long_sweep.h"

namespace loopbench::harness {

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
