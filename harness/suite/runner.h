// Pieces of work, their processes, and the line that shows progress.
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

// A progress line with the time still to go, on standard error when that is a terminal.

/// Shows what is under way from the first moment on. Silent when standard error is no terminal.
class Progress {
 public:
  /// A piece of work: what people call it, and how long it will take about [s], NaN where nobody
  /// knows: then as long as the others.
  struct Piece {
    std::string label;
    double estimate_s;
  };

  /// `jobs` pieces are under way at once.
  Progress(std::string what, std::vector<Piece> pieces, int jobs);
  ~Progress();  ///< clears the line
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  static bool IsSeen();

  void Start(std::size_t piece);
  void Done(std::size_t piece);
  /// Draws the line anew if a second has passed.
  void Look();

 private:
  using Clock = std::chrono::steady_clock;
  struct Running {
    std::size_t piece;
    Clock::time_point begin;
  };

  /// Estimates are corrected by what the pieces that are done have taken. Negative: not known.
  double SecondsToGo() const;
  void Draw();

  std::string what_;
  std::vector<Piece> pieces_;
  int jobs_;
  bool is_seen_;
  std::size_t done_ = 0;
  double taken_s_ = 0.0, foreseen_s_ = 0.0;  ///< of the pieces that are done
  double waiting_s_ = 0.0;                   ///< foreseen for those that have not begun
  std::vector<Running> running_;
  Clock::time_point begin_, drawn_;
};

// One process of a run: the records it owes, and how to make them.

struct Piece {
  std::vector<Record> owed;     ///< keys, case_id and content: known but for their results
  std::int64_t experiment = 0;  ///< which of the command's
  std::function<std::vector<Record>(int threads)> work;
  ProcessLimits limits;
  std::string label;
  double cost = 0.0;                      ///< costly ones go first
  int threads = 1;                        ///< of `work`, which may need fewer
  std::filesystem::path product = {};     ///< a file without which the piece is not done
  std::filesystem::path trajectory = {};  ///< one that its process may leave unfinished
  std::function<double(Estimate&)> seconds = {};
};

/// What experiments run, which must outlive the pieces.
/// @param one    with its id
/// @param store  the file beside which references are kept
Piece AccuracyPiece(const Experiment& experiment, const Case& one,
                    const std::filesystem::path& store);
Piece ReferencePiece(const Experiment& experiment, const ReferenceCase& one);
Piece TimingPiece(const Experiment& experiment, const TimingGroup& group);
Piece LadderPiece(const Experiment& experiment, const LadderGroup& group);

/// The child's side: all records, one a line.
std::string AnswerOf(const Piece& piece);

/// The parent's side: what the piece owes, filled from the answer or with the reason why not.
/// @param set  what --set changed
std::vector<Record> RecordsOf(const Piece& piece, const ProcessResult& result,
                              const std::string& set);

// Runs pieces that a store does not have yet, and puts their records into it.

class Runner {
 public:
  /// `finished` is what the store has when the run begins.
  Runner(const SuiteOptions& options, FinishedRuns& finished, ResultStore& store)
      : options_(options), finished_(finished), store_(store) {}

  /// What is not done yet of `pieces`, which stand in the order of the experiments.
  /// @param estimate  of their experiments
  /// @param shared    short ones may share a process
  /// @returns  how many of their records have another outcome than "finished"
  std::size_t Run(const std::string& what, std::vector<Piece> pieces, int jobs, bool shared,
                  Estimate* estimate);

  /// What was asked for so far: cases of a long sweep are told from those of their group alone.
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
