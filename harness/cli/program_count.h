// Options of the subcommand count.
#pragma once

#include <CLI/CLI.hpp>
#include <optional>
#include <string>

#include "harness/cli/commands_count.h"

namespace loopbench::harness {

class CountOptions {
 public:
  /// Adds the subcommand to `app`, which must outlive this.
  explicit CountOptions(CLI::App& app);

  /// Runs it if it was parsed: its exit code.
  std::optional<int> Run(const std::string& typed) const;

 private:
  CLI::App* app_;
  CountCommand count_;
};

}  // namespace loopbench::harness
