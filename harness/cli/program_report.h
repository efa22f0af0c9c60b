// Options of the subcommand report.
#pragma once

#include <CLI/CLI.hpp>
#include <optional>
#include <string>

#include "harness/cli/commands_page.h"

namespace loopbench::harness {

class ReportCommandOptions {
 public:
  /// Adds the subcommand to `app`, which must outlive this.
  explicit ReportCommandOptions(CLI::App& app);

  /// Runs it if it was parsed: its exit code.
  std::optional<int> Run(const std::string& typed) const;

 private:
  CLI::App* app_;
  ReportCommand report_;
};

}  // namespace loopbench::harness
