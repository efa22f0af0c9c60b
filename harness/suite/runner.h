// Pieces of work, their processes, and the progress line.
#pragma once

#include <chrono>
#include <filesystem>
#include <functional>
#include <string>
#include <unordered_set>
#include <vector>

#include "harness/isolation/processes.h"
#include "harness/store/result_store.h"
#include "harness/suite/estimate.h"
#include "harness/suite/suite.h"

namespace loopbench::harness {

// Progress line with the remaining time, on standard error if it is a terminal.

/// Shows the running pieces from the start. Silent if standard error is no terminal.
class Progress {
 public:
  /// A piece of work: label and estimated duration [s]. NaN if unknown: the average of the other
  /// pieces is used.
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
  using Clock = std::chrono::steady_clock;
  struct Running {
    std::size_t piece;
    Clock::time_point begin;
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
  Clock::time_point begin_, drawn_;
};

// One process of a run: its expected records and the function that makes them.

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

/// Pieces of an experiment, which must outlive them.
/// @param one    case with its id
/// @param store  the store file; references lie in its folder
Piece AccuracyPiece(const Experiment& experiment, const Case& entry,
                    const std::filesystem::path& store);
Piece ReferencePiece(const Experiment& experiment, const ReferenceCase& reference);
Piece TimingPiece(const Experiment& experiment, const TimingGroup& group);
Piece LadderPiece(const Experiment& experiment, const LadderGroup& group);

/// Returns the expected records, filled from the answer or with the reason (parent process).
/// @param set  changes by --set
std::vector<Record> RecordsOf(const Piece& piece, const ProcessResult& result,
                              const std::string& set);

// Runs the pieces that a store does not contain yet, and stores their records.

class Runner {
 public:
  /// `finished`: records in the store when the run begins.
  Runner(const SuiteOptions& options, FinishedRuns& finished, ResultStore& store)
      : options_(options), finished_(finished), store_(store) {}

  /// Runs the unfinished pieces of `pieces`, which are in the order of the experiments.
  /// @param estimate  time estimates of their experiments
  /// @param shared    short pieces may share a process
  /// @returns  number of their records with an outcome other than "finished"
  std::size_t Run(const std::string& what, std::vector<Piece> pieces, int jobs, bool shared,
                  Estimate* estimate);

  /// Forgets all requests so far: cases of a long sweep are distinguished within their group only.
  void Forget() {
    asked_.clear();
    count.ids.clear();
  }

  SuiteCount count;

 private:
  bool Done(const Piece& piece, std::size_t* failed);
  std::vector<Piece> NotAsked(std::vector<Piece> pieces);

  const SuiteOptions& options_;
  FinishedRuns& finished_;
  ResultStore& store_;
  std::unordered_set<std::string> asked_;  ///< ids
};

}  // namespace loopbench::harness
