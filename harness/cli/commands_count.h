// count: exact numbers of operations of right-hand sides.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "harness/cli/commands.h"

namespace loopbench::harness {

struct CountCommand {
  std::vector<std::filesystem::path> mechanisms;
  std::string family;      ///< of mechanisms of any size (sized_family.h), beside the files
  std::vector<int> sizes;  ///< members of the family
  /// Names to count; empty: every formulation, every recorded level, both coordinate sets.
  std::vector<std::string> formulations, levels, coordinates;
  std::vector<std::string> solvers = {"rank-revealing"};
  std::string format = "text";  ///< text, csv, markdown, json or latex
  std::filesystem::path out;    ///< standard output when empty
  ProcessLimits limits = kFileLimits;
};

/// Prints one row per right-hand side. Returns 2 if none was recorded.
int CountOperations(const CountCommand& command, const std::string& typed);

}  // namespace loopbench::harness
