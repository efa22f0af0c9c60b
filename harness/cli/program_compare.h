// Options of the subcommands compare, fit and export: those that hold measurements together.
#pragma once

#include <CLI/CLI.hpp>
#include <optional>
#include <string>
#include <vector>

#include "harness/cli/commands_compare.h"

namespace loopbench::harness {

class ComparisonOptions {
 public:
  /// Adds the subcommands to `app`, which must outlive this.
  explicit ComparisonOptions(CLI::App& app);

  /// Runs the subcommand that was parsed, if it is one of these: its exit code.
  std::optional<int> Run(const std::string& typed);

 private:
  /// BASE and NEW of compare.
  void TakeFiles();

  std::vector<std::filesystem::path> files_;
  CLI::App *compare_app_, *fit_app_, *export_app_;
  std::vector<std::string> conditions_;  ///< --where, as typed
  CompareCommand compare_;
  FitCommand fit_;
  ExportCommand export_;
};

}  // namespace loopbench::harness
