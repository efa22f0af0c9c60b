// Options of submit, status and collect.
#pragma once

#include <CLI/CLI.hpp>
#include <optional>
#include <string>

#include "harness/cli/commands_cluster.h"

namespace loopbench::harness {

class ClusterOptions {
 public:
  explicit ClusterOptions(CLI::App& app);

  /// The exit code, when one of its subcommands was given.
  std::optional<int> Run();

 private:
  CLI::App *submit_app_, *status_app_, *collect_app_;
  SubmitCommand submit_;
  std::string time_, partition_;
  bool no_timing_ = false, no_queue_ = false, json_ = false;
  std::filesystem::path folder_;
};

}  // namespace loopbench::harness
