// The subcommands submit, status and collect: a run in parts. As commands.h.
#pragma once

#include <filesystem>

#include "harness/cluster/cluster_folder.h"

namespace loopbench::harness {

struct SubmitCommand {
  ClusterRun run;
  std::filesystem::path folder;
  bool again = false;  ///< the parts of a folder that is there and that are neither done nor queued
  bool queue = true;   ///< false: write the folder only, for another engine
  bool dry_run = false;  ///< print the scripts, write nothing
};
int Submit(SubmitCommand command);

/// 0; 2 when the folder is none.
int PrintStatus(const std::filesystem::path& folder, bool json);

/// All parts into folder/whole, in the order of the experiments: 0. 1, and nothing is written, when
/// a case is missing.
int Collect(const std::filesystem::path& folder);

}  // namespace loopbench::harness
