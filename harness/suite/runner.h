// Runs pieces that a store does not have yet, and puts their records into it.
#pragma once

#include <string>
#include <unordered_set>
#include <vector>

#include "harness/store/finished_runs.h"
#include "harness/store/result_store.h"
#include "harness/suite/piece.h"
#include "harness/suite/suite.h"

namespace loopbench::harness {

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
