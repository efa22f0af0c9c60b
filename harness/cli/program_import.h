// Options of the subcommand import.
#pragma once

#include <CLI/CLI.hpp>
#include <optional>
#include <string>

#include "harness/cli/commands_import.h"

namespace loopbench::harness {

class ImportCommandOptions {
 public:
  /// Adds the subcommand to `app`, which must outlive this.
  explicit ImportCommandOptions(CLI::App& app);

  /// Runs it if it was parsed: its exit code.
  std::optional<int> Run();

 private:
  CLI::App* app_;
  ImportCommand import_;
  std::string gravity_;
};

}  // namespace loopbench::harness
