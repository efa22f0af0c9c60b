// What engines call in the folder of a run in parts.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "harness/cluster/cluster_folder.h"

namespace loopbench::harness {

/// The scripts, as texts. `parts`: those that are to run, from 1.
std::string PartScript(const ClusterRun& run, const std::filesystem::path& folder);
std::string ArrayScript(const ClusterRun& run, const std::filesystem::path& folder,
                        const std::vector<int>& parts);
std::string CollectScript(const ClusterRun& run, const std::filesystem::path& folder);

}  // namespace loopbench::harness
