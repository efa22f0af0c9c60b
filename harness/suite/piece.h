// One process of a run: the records it owes, and how to make them.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "harness/isolation/processes.h"
#include "harness/suite/estimate.h"

namespace loopbench::harness {

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

}  // namespace loopbench::harness
