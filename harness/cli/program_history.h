// Options of history and its subcommands.
#pragma once

#include <CLI/CLI.hpp>
#include <optional>
#include <string>

#include "harness/cli/commands_history.h"

namespace loopbench::harness {

class HistoryOptions {
 public:
  explicit HistoryOptions(CLI::App& app);

  /// The exit code, when its subcommand was given.
  std::optional<int> Run(const std::string& typed);

 private:
  CLI::App *app_, *add_app_, *show_app_, *report_app_, *mark_app_;
  HistoryPlace place_;
  HistoryAddCommand add_;
  HistoryShowCommand show_;
  HistoryReportCommand report_;
  HistoryMarkCommand mark_;
};

}  // namespace loopbench::harness
