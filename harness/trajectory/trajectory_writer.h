// Writes a trajectory row by row, in memory of a fixed size.
//
// Rows go to PATH.part, which takes its name when all are there: who reads PATH finds all of it or
// nothing. A writer that goes without Finish() takes its part with it; one that is killed leaves
// it, for RemoveParts().
#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "harness/text/hash.h"
#include "harness/text/output_file.h"
#include "harness/trajectory/columns.h"

namespace loopbench::harness {

enum class TrajectoryFormat { kCsv, kJsonLines };

class TrajectoryWriter {
 public:
  /// Makes missing folders. `notes` become lines with "#", of CSV alone. Throws std::runtime_error,
  /// here and below, where the system refuses.
  TrajectoryWriter(const std::filesystem::path& path, const std::vector<TrajectoryColumn>& columns,
                   const std::vector<std::string>& notes,
                   TrajectoryFormat format = TrajectoryFormat::kCsv);
  TrajectoryWriter(const TrajectoryWriter&) = delete;
  TrajectoryWriter& operator=(const TrajectoryWriter&) = delete;

  /// Numbers with as many digits as tell them from their neighbours; nan, in JSON null.
  void Write(std::span<const double> row);
  std::int64_t rows() const { return rows_; }

  /// Once, at the end: the file is on the disk. Returns the hash of all its bytes.
  std::string Finish(const std::vector<std::string>& notes = {});

 private:
  void Note(const std::string& note);
  void Flush();

  OutputFile file_;
  FnvHash hash_;
  TrajectoryFormat format_;
  std::vector<std::string> labels_;  ///< of JSON, as it has them
  std::string buffer_;
  std::int64_t rows_ = 0;
};

/// What killed runs have left in the folder of trajectories beside a store's `file`, or one of
/// them.
void RemoveParts(const std::filesystem::path& store_file);
void RemovePart(const std::filesystem::path& path);

}  // namespace loopbench::harness
