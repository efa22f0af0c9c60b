// The subcommands of the program, apart from their option parsing (main.cpp).
//
// Each returns an exit code: 0 done, 1 a gate failed, 2 could not measure or bad input. Bad input
// throws ConfigError or std::runtime_error, which main() turns into a message and 2.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "harness/suite.h"

namespace loopbench::harness {

struct RunCommand {
  std::vector<std::filesystem::path> experiments;
  std::filesystem::path out;  ///< folder; default results/runs/<name of the first experiment>
  SuiteOptions suite;
};
/// Runs what the store does not have yet, then writes its tables.
int Run(const RunCommand& command, const std::string& typed);

struct MergeCommand {
  std::vector<std::filesystem::path> stores;
  std::filesystem::path out;  ///< a new store
};
/// Shards into one store: every case once. Throws when two stores disagree about a case.
int Merge(const MergeCommand& command);

int List(const std::vector<std::filesystem::path>& experiments, const Selection& filter);

int CheckFiles(const std::vector<std::filesystem::path>& files);

struct TableCommand {
  std::filesystem::path store;
  std::string kind = "drift";   ///< drift, timing or factorial
  std::string format = "text";  ///< text, csv or markdown
  Selection where;
  std::filesystem::path out;  ///< standard output when empty
};
int PrintTable(const TableCommand& command, const std::string& typed);

struct PlotCommand {
  std::filesystem::path store, out;
  Selection where;
};
int Plot(const PlotCommand& command);

struct VerdictCommand {
  std::filesystem::path store, claims, out;
};
int PrintVerdicts(const VerdictCommand& command, const std::string& typed);

}  // namespace loopbench::harness
