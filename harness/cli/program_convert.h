// Options of the subcommand convert.
#pragma once

#include <CLI/CLI.hpp>
#include <optional>

#include "harness/cli/commands_convert.h"

namespace loopbench::harness {

class ConvertOptions {
 public:
  /// Adds the subcommand to `app`, which must outlive this.
  explicit ConvertOptions(CLI::App& app);

  /// Runs it if it was parsed: its exit code.
  std::optional<int> Run() const;

 private:
  CLI::App* app_;
  ConvertCommand convert_;
};

}  // namespace loopbench::harness
