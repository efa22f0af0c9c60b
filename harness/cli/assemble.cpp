// assemble: the start of a mechanism, and the other positions that close its loops.

#include <fmt/format.h>

#include "harness/cli/command_line.h"
#include "harness/cli/commands.h"
#include "harness/config/mechanism_reader.h"
#include "harness/isolation/processes.h"
#include "harness/text/escape.h"
#include "harness/text/files.h"
#include "harness/text/terminal.h"
#include "mechanism/start/branches.h"

namespace loopbench::harness {
namespace {

struct AssembleCommand {
  std::filesystem::path mechanism;
  std::filesystem::path out;  ///< folder for a mechanism file per branch; "": none
  int starts = 200;
  bool all = false;
  ProcessLimits limits = kFileLimits;
};

/// Prints the branches: coordinates of joints in the tree, a row per branch.
void PrintBranches(const MechanismDescription& description, const Branches& branches,
                   const ExplainView& view) {
  Table table;
  table.columns = {{"branch", "branch", Format::kInteger},
                   {"times", "starts", Format::kInteger},
                   {"distance", "distance", Format::kShortest}};
  for (std::size_t k = 0; k < branches.found.size(); ++k) {
    const Branch& branch = branches.found[k];
    Record& row = AddRow({k + 1, branch.times, branch.distance}, &table);
    for (const JointValues& values : branch.description.initial.coordinates) {
      const JointDescription& joint = description.joints[values.joint];
      const std::vector<ValueWord> words = ValueWords(joint.type, description.space, false);
      for (std::size_t i = 0; i < values.values.size() && i < words.size(); ++i) {
        const std::string key = fmt::format("{}.{} [{}]", joint.name, words[i].name, words[i].unit);
        if (k == 0) table.columns.push_back({key, key, Format::kShortest});
        row.Set(key, values.values[i]);
      }
    }
  }
  PrintSection("Branches", table, view, "branches");
}

int AssembleFile(const AssembleCommand& command, const ExplainView& view) {
  const MechanismFile file = ReadMechanism(command.mechanism);
  Branches branches;
  try {
    branches = FindBranches(file.description, command.starts);
  } catch (const std::invalid_argument& error) {
    throw ConfigError(fmt::format("{}: {}", command.mechanism.string(), error.what()));
  }
  if (branches.freedom > 0) {
    throw ConfigError(fmt::format(
        "{}: found {} free motions, expected none: list as many coordinates under \"fixed\", so "
        "that positions are isolated",
        command.mechanism.string(), branches.freedom));
  }
  Print("{} ({})\n", file.description.name, command.mechanism.string());
  PrintBranches(file.description, branches, view);
  Print(
      "  {} of {} scattered starts closed. Branch 1 is the start of the file; distance: largest\n"
      "  difference of a body's pose from it [rad, or mean links].\n",
      branches.closed, branches.starts);
  if (branches.movable > 0) {
    Print("  {} of them led to positions that still move, which are not listed.\n",
          branches.movable);
  }
  for (std::size_t k = 0; k < branches.found.size() && !command.out.empty(); ++k) {
    MechanismDescription description = branches.found[k].description;
    description.name = fmt::format("{}-branch-{}", file.description.name, k + 1);
    ObservedQuantities known;
    known.expected = file.observe.expected;
    WriteFileAtomically(command.out / (FileName(description.name) + ".json"),
                        MechanismText(description, known));
  }
  if (!command.out.empty()) {
    Print("\nwrote {} files to {}; loopbench view shows them\n", branches.found.size(),
          command.out.string());
  }
  return 0;
}

}  // namespace

void AddAssemble(Commands& commands) {
  auto& command = commands.Keep<AssembleCommand>();
  commands.Add("assemble", "Find all positions that close a mechanism's loops",
               [&](const Typed&) {
                 return PrintFromChild(command.mechanism.string(), command.limits, [&] {
                   return AssembleFile(command, ViewOfOutput(command.all));
                 });
               },
               {MechanismArgument(&command.mechanism),
                {"-o,--out", "Folder for a mechanism file per branch", &command.out},
                {"--starts", "Scattered starts", &command.starts, From(1, 1e6)},
                WideOption(),
                CpuOption(&command.limits),
                MemoryOption(&command.limits),
                {"--all", "Print all rows of long tables", &command.all}});
}

}  // namespace loopbench::harness
