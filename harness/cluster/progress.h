// How far the parts of a run are, from their stores alone.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

#include "harness/cluster/cluster_folder.h"

namespace loopbench::harness {

struct PartProgress {
  int part = 1;
  std::string state;                 ///< done, running, pending, stopped, waiting, ...
  double cases = 0.0;                ///< NaN: not counted
  std::size_t done = 0, failed = 0;  ///< different cases that finished, and that ended otherwise
  double rate = 0.0;                 ///< of records since it began last [1/s]; 0: not known
};

/// From the folder alone: a part is running when its store is locked, and else done, stopped once
/// it has begun, or waiting.
/// @param now  [s] since 1970
PartProgress ProgressOfPart(const ClusterRun& run, const std::filesystem::path& folder, int part,
                            double now);

/// Seconds until all cases are there, by the rates of the parts that run; NaN when none does.
double SecondsLeft(const ClusterRun& run, const std::vector<PartProgress>& parts);

}  // namespace loopbench::harness
