// Options of the subcommand view.
#pragma once

#include <CLI/CLI.hpp>
#include <optional>

#include "harness/cli/commands_view.h"

namespace loopbench::harness {

class ViewOptions {
 public:
  /// Adds the subcommand to `app`, which must outlive this.
  explicit ViewOptions(CLI::App& app);

  /// Runs it if it was parsed: its exit code.
  std::optional<int> Run() const;

 private:
  CLI::App* app_;
  ViewCommand view_;
};

}  // namespace loopbench::harness
