// generate: a mechanism's equations of motion as C99, and as a Functional Mock-up Unit.
#pragma once

#include <CLI/CLI.hpp>
#include <filesystem>
#include <optional>
#include <string>

#include "harness/cli/commands.h"

namespace loopbench::harness {

struct GenerateCommand {
  std::filesystem::path mechanism, out;
  std::filesystem::path fmu;  ///< "": none
  std::string formulation = "lagrange", level = "acceleration", coordinates = "joint";
  std::string solver = "rank-revealing";
  double horizon = 10.0;  ///< of the motion whose branches are generated [s]
  double step = 0.0;      ///< of the example and of co-simulation [s]; 0: of the motion
  bool json = false;
  ProcessLimits limits = kFileLimits;
};

class GenerateOptions {
 public:
  /// Adds the subcommand to `app`, which must outlive this.
  explicit GenerateOptions(CLI::App& app);

  /// Runs it if it was parsed: its exit code.
  std::optional<int> Run() const;

 private:
  CLI::App* app_;
  GenerateCommand generate_;
};

}  // namespace loopbench::harness
