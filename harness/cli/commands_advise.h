// The subcommand advise.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "harness/isolation/processes.h"

namespace loopbench::harness {

struct AdviseCommand {
  std::filesystem::path mechanism;
  double error = 0.0;               ///< to be kept [m]; 0: not given
  double budget = 0.0;              ///< wall seconds per simulated second; 0: not given
  double horizon = 10.0;            ///< [s]
  std::vector<std::string> points;  ///< BODY.POINT or BODY; empty: all
  std::filesystem::path out;        ///< file of the experiment that reproduces the advice
  std::string format = "text";      ///< of the table: text, csv, markdown, json, latex
  bool simplify = false;            ///< simpler models of the scene too
  bool generated = false;           ///< generated code too
  bool exhaustive = false;          ///< the whole product in place of a pilot
  ProcessLimits limits = {.cpu_s = 120.0, .memory_mb = 2048.0};
};

/// Prints the cheapest way to run the mechanism that keeps the error, or the most accurate within
/// the budget, and what that rests on. 1 where nothing reached what was asked for.
int Advise(const AdviseCommand& command, const std::string& typed);

}  // namespace loopbench::harness
