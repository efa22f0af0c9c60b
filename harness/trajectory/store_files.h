// Trajectories of a store: the files that its records name.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "harness/record/record.h"

namespace loopbench::harness {

/// The file of a record's trajectory, beside the store's `file`; empty where the record has none.
/// Only a name within the folder of trajectories is one.
std::filesystem::path TrajectoryOf(const Record& record, const std::filesystem::path& store_file);

/// Copies those of `records` from the first of the `stores` that has them to beside `target`, each
/// whole or not at all. Gives the names of those that none has.
std::vector<std::string> CopyTrajectories(const std::vector<Record>& records,
                                          const std::vector<std::filesystem::path>& stores,
                                          const std::filesystem::path& target);

}  // namespace loopbench::harness
