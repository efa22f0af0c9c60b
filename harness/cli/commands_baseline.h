// The subcommand that keeps a repository's own baseline: measured again, held against what is
// committed. As commands.h.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "harness/cli/commands.h"

namespace loopbench::harness {

struct BaselineCommand {
  std::string action;  ///< check, renew or selftest
  std::vector<std::filesystem::path> experiments;
  std::filesystem::path dir;      ///< of results.jsonl, which is committed
  std::filesystem::path counts;   ///< benchmarks whose instructions are counted; none when empty
  std::filesystem::path counter;  ///< loopbench_count; empty: beside this program, else from PATH
  std::filesystem::path keep;     ///< folder for what was measured; a temporary one when empty
  int jobs = 1;
};

/// check: 0 the same or better, 1 worse, 2 could not measure. renew: 0, and dir/results.jsonl is
/// what was measured. selftest: 0 when each planted change was caught, 1 when one was not.
/// @throws ConfigError when valgrind or loopbench_count are wanted and not there, before anything
///         is measured
int Baseline(const BaselineCommand& command, const std::string& typed);

}  // namespace loopbench::harness
