// Trajectories of a store: the files that its records name.
#pragma once

#include <filesystem>
#include <stdexcept>
#include <string>
#include <vector>

#include "harness/record/record.h"

namespace loopbench::harness {

/// The file of a record's trajectory, beside the store's `file`; empty where the record has none.
/// Only a name within the folder of trajectories is one.
std::filesystem::path TrajectoryOf(const Record& record, const std::filesystem::path& store_file);

/// A file beside a store that is not as a run wrote it.
class ChangedFile : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Throws ChangedFile unless the file has the "trajectory_hash" of its record, or the record has
/// none (of version 1.0).
void VerifyTrajectory(const Record& record, const std::filesystem::path& file);

/// Copies the trajectories of `records` from the first of the `stores` that has them to beside
/// `target`, each whole or not at all. Returns the names of those that no store has as its run
/// wrote them.
std::vector<std::string> CopyTrajectories(const std::vector<Record>& records,
                                          const std::vector<std::filesystem::path>& stores,
                                          const std::filesystem::path& target);

}  // namespace loopbench::harness
