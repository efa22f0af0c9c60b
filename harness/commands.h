// The subcommands of the program, apart from their option parsing (main.cpp).
//
// Each returns an exit code: 0 done, 1 a gate failed, 2 could not measure or bad input. Bad input
// throws ConfigError or std::runtime_error, which main() turns into a message and 2.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "harness/config/experiment_reader.h"
#include "harness/suite.h"

namespace loopbench::harness {

struct RunCommand {
  std::vector<std::filesystem::path> experiments;
  std::filesystem::path out;  ///< folder; default results/runs/<name of the first experiment>
  std::vector<Setting> settings;
  SuiteOptions suite;
};
int Run(const RunCommand& command, const std::string& typed);

/// Experiment files and what is changed and chosen of them.
struct ExperimentFiles {
  std::vector<std::filesystem::path> paths;
  std::vector<Setting> settings;
  Selection filter;
};

/// The experiments of the files, each combination of a sweep one, of which at least one case passes
/// the filter. Throws ConfigError as the reader does, and when no case of a file passes.
std::vector<Experiment> ReadSelected(const ExperimentFiles& files);

int List(const ExperimentFiles& files);

int CheckFiles(const ExperimentFiles& files);

struct PlanCommand {
  ExperimentFiles files;
  std::filesystem::path from;  ///< store of earlier results; times of cases it has come from there
};
int PrintPlans(const PlanCommand& command);

int Explain(const ExperimentFiles& files);

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
