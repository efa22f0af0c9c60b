#include "harness/cli/program.h"

#include <exception>
#include <new>

#include "harness/cli/commands.h"
#include "harness/config/formulations.h"
#include "mechanism/algebra/dense_memory.h"

namespace loopbench {
namespace harness {
namespace {

// {}: the names of formulations and levels
constexpr const char* kFooter = R"(Examples (from the root of the repository):
  loopbench view configs/mechanisms/double-wishbone.json
  loopbench run configs/experiments/paper/paper.json --jobs 2 --filter mechanism=four-bar
  loopbench table results/runs/paper --where mechanism=four-bar,dead-centre --where rtol=1e-8
  loopbench advise configs/mechanisms/four-bar.json --max-error 1e-6

`loopbench COMMAND --help` shows options and examples of a command.

Conditions are key=value, key=value,value, key!=value, or for numbers 'key<value' (<=, >, >=). Keys are
the columns of drift.csv; before a run, only keys that identify cases.
Formulations: {}.
Levels of enforcement: {}.
Exit status: 0 success; 1 a check failed; 2 invalid input, or nothing could be measured; 130 interrupted.)";

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
  Commands commands;
  for (const auto add : {AddRun, AddExperiments, AddExplain, AddSimplify, AddFormats, AddAdvise,
                         AddView, AddImport, AddConvert, AddGenerate, AddResults, AddTrajectory,
                         AddCount, AddComparison, AddBaseline, AddCluster, AddHistory}) {
    add(commands);
  }
  const CommandInputs inputs;
  try {
    return commands.Run(
        argc, argv,
        fmt::format(kFooter, fmt::join(FormulationNames(), ", "), fmt::join(LevelNames(), ", ")));
  } catch (const std::bad_alloc& error) {
    PrintError("{}\n", Lines{OutOfMemory(error, {argv + 1, argv + argc})});
  } catch (const std::exception& error) {
    PrintError("{}\n", Lines{WithMigrationHint(error.what())});
  }
  return 2;
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
