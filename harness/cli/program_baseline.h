// Options of baseline.
#pragma once

#include <CLI/CLI.hpp>
#include <optional>
#include <string>

#include "harness/cli/commands_baseline.h"

namespace loopbench::harness {

class BaselineOptions {
 public:
  explicit BaselineOptions(CLI::App& app);

  /// The exit code, when its subcommand was given.
  std::optional<int> Run(const std::string& typed);

 private:
  CLI::App* app_ = nullptr;
  BaselineCommand command_;
};

}  // namespace loopbench::harness
