// trajectory: what a run wrote over time, or somebody else's against a mechanism. As commands.h.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "harness/record/select.h"
#include "harness/trajectory/trajectory_writer.h"

namespace loopbench::harness {

struct TrajectoryCommand {
  std::filesystem::path source;  ///< a store, or a trajectory (.csv)
  Selection where;               ///< of a store's records
  std::filesystem::path out;     ///< file, or folder of a store's; nothing is written when empty
  std::string format = "csv";    ///< csv or jsonl
  std::vector<std::string> columns;  ///< labels, or beginnings of labels; empty: all
  int every = 1;                     ///< rows that are kept: the first, and each so many-th after
  std::filesystem::path mechanism;   ///< to hold a trajectory against
  std::filesystem::path ours;        ///< another trajectory of it
  std::filesystem::path figure;      ///< .svg or .pdf, with `ours`
};
/// Lists the trajectories of a store; writes them to `out`; checks one against a mechanism; lays
/// one beside ours.
int ShowTrajectories(const TrajectoryCommand& command, const std::string& typed);

}  // namespace loopbench::harness
