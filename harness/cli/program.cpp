#include "harness/cli/program.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <exception>
#include <filesystem>
#include <new>
#include <string>
#include <string_view>
#include <vector>

#include "harness/cli/command_line.h"
#include "harness/cli/commands.h"
#include "harness/config/formulations.h"
#include "harness/record/provenance.h"
#include "harness/store/result_store.h"
#include "harness/text/files.h"
#include "harness/text/run_program.h"
#include "harness/text/terminal.h"
#include "mechanism/model/dense_memory.h"

namespace loopbench {
namespace harness {
namespace {

// {}: the names of formulations and levels
constexpr const char* kFooter = R"(
Examples: (paths from the root of the repository)
  loopbench list configs/experiments/paper/paper.json
  loopbench estimate configs/experiments/paper/paper.json --set /limits/cpu_s=5
  loopbench run configs/experiments/paper/paper.json --jobs 2 --filter mechanism=four-bar
  loopbench view configs/mechanisms/double-wishbone.json
  loopbench import arm.urdf --loops arm-loops.json --out arm.json
  loopbench count configs/mechanisms/four-bar.json
  loopbench generate configs/mechanisms/four-bar.json --out four-bar-c
  loopbench simplify configs/experiments/models/hall.json --verify 2
  loopbench run big.json --shard 1/2 --out part1   (and 2/2 elsewhere)
  loopbench merge part1 part2 --out whole
  loopbench table results/runs/paper --where mechanism=four-bar,dead-centre --where rtol=1e-8
  loopbench plot results/runs/paper --out results/runs/paper/figures
  loopbench run configs/experiments/precision.json --precision-only --jobs 2
  loopbench work-precision results/runs/work-precision --figures
  loopbench report results/runs/work-precision
  loopbench check-claims results/runs/paper --claims configs/experiments/paper/claims.json
  loopbench robustness results/runs/extremes --rules configs/experiments/extremes/map.json

Conditions are key=value, key=value,value, key!=value, or of numbers 'key<value' (<=, >, >=), quoted
for the shell; keys are the columns of drift.csv, and before a run those that name cases.
Formulations: {}.
Levels of enforcement: {}.
Exit codes: 0 done, 1 a gate failed, 2 could not measure or bad input, 130 run was interrupted.)";

/// Makes an option take only the next word, because file names may follow. Only experiments of a
/// baseline are given as the shell expands them.
void TakeOneWordEach(CLI::App* app) {
  for (CLI::Option* option : app->get_options()) {
    if (!option->get_positional() && !option->check_lname("experiments")) {
      option->allow_extra_args(false);
    }
  }
  for (CLI::App* command : app->get_subcommands({})) TakeOneWordEach(command);
}

/// Sets the headings of `loopbench --help`.
void GroupCommands(CLI::App& app) {
  const std::pair<const char*, std::vector<const char*>> groups[] = {
      {"Mechanisms",
       {"check", "explain", "view", "simplify", "import", "export-mechanism", "count", "generate"}},
      {"Experiments", {"list", "estimate", "run", "merge", "advise"}},
      {"Results",
       {"table", "plot", "report", "trajectory", "work-precision", "robustness", "check-claims"}},
      {"Regressions", {"compare", "fit-scaling", "export-metrics", "baseline", "history"}},
      {"Clusters", {"submit", "status", "collect"}},
      {"Shell", {"schema", "migrate", "completion", "manual"}}};
  for (const auto& [heading, names] : groups) {
    for (const char* name : names) app.get_subcommand(name)->group(heading);
  }
}

/// Names the largest input of a command that ran out of memory, and its memory limit.
std::string OutOfMemory(const std::bad_alloc& error, const std::vector<std::string>& words) {
  std::string largest;
  std::uintmax_t bytes = 0;
  for (const std::string& word : words) {
    std::error_code fault;
    std::filesystem::path file = word;
    if (std::filesystem::is_directory(file, fault)) file = StoreFile(file);
    if (!std::filesystem::is_regular_file(file, fault)) continue;
    const std::uintmax_t size = std::filesystem::file_size(file, fault);
    if (fault || size < bytes) continue;
    bytes = size;
    largest = file.string();
  }
  std::string message = "out of memory";
  if (const auto* known = dynamic_cast<const TooDense*>(&error)) {
    message += fmt::format(": {}", known->what());
  }
  if (!largest.empty())
    message += fmt::format(": {} has {:.0f} MB", largest, 1e-6 * static_cast<double>(bytes));
  return message + fmt::format(", and this process may use {:.0f} MB", 1e-6 * FreeMemory(true));
}

int RunCommandLine(int argc, char** argv) {
  CLI::App app{
      "Measures constraint drift and time of formulations of closed-loop multibody dynamics.",
      "loopbench"};
  app.footer(
      fmt::format(kFooter, fmt::join(FormulationNames(), ", "), fmt::join(LevelNames(), ", ")));
  app.set_version_flag("--version", VersionText);
  app.require_subcommand(1);
  app.failure_message([](const CLI::App* failed, const CLI::Error& error) {
    return EscapeTerminalLines(CLI::FailureMessage::simple(failed, error) + WhatWasMeant(*failed));
  });
  Commands commands(&app);
  for (const auto add :
       {AddRun,        AddList,       AddCheck,    AddPlan,    AddExplain, AddSimplify, AddSchema,
        AddMigrate,    AddAdvise,     AddView,     AddMerge,   AddTable,   AddPlot,     AddTradeoff,
        AddTrajectory, AddVerdict,    AddMap,      AddReport,  AddImport,  AddConvert,  AddGenerate,
        AddCount,      AddComparison, AddBaseline, AddCluster, AddHistory, AddShell}) {
    add(commands);
  }
  TakeOneWordEach(&app);
  GroupCommands(app);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }
  const CommandInputs inputs;
  try {
    return commands.Run({CommandLine(argc, argv), ShellLine({argv, argv + argc})});
  } catch (const std::bad_alloc& error) {
    PrintError("{}\n", Lines{OutOfMemory(error, {argv + 1, argv + argc})});
    return 2;
  } catch (const std::exception& error) {
    PrintError("{}\n", Lines{WithMigrationHint(error.what())});
    return 2;
  }
}

}  // namespace
}  // namespace harness

int Main(int argc, char** argv) {
  constexpr std::string_view kNoMemory = "out of memory: too little is left for a longer message\n";
  harness::PrepareStreams();
  harness::ExitWithoutMemory(2, kNoMemory);
  try {
    return harness::FinishOutput(harness::RunCommandLine(argc, argv));
  } catch (const std::bad_alloc&) {  // while options were set up or a message was written
    harness::PrintErrorText(kNoMemory);
    return 2;
  }
}

}  // namespace loopbench
