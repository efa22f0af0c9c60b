#include "harness/isolation/print_from_child.h"

#include <unistd.h>

#include <cstdio>
#include <stdexcept>

#include "harness/text/files.h"
#include "harness/text/memory_file.h"
#include "harness/text/terminal.h"

namespace loopbench::harness {
namespace {

/// @param deliver  takes what was printed, before anything is thrown
int FromChild(const std::string& name, const ProcessLimits& limits,
              const std::function<int()>& work,
              const std::function<void(const std::string&)>& deliver) {
  const MemoryFile output("stdout");
  ProcessResult result;
  try {
    RunInProcesses(
        1, 1,
        [&](std::size_t) {
          // line by line, so that a killed child loses no line
          ::dup2(output.descriptor(), STDOUT_FILENO);
          ::setlinebuf(stdout);
          return std::to_string(FinishOutput(work()));
        },
        [&](std::size_t) { return limits; },
        [&](std::size_t, const ProcessResult& ended) { result = ended; });
  } catch (const SystemFault&) {
    deliver(output.Text());
    throw;
  }
  deliver(output.Text());
  if (result.ending == ProcessEnding::kThrew) throw std::runtime_error(result.text);
  if (result.ending == ProcessEnding::kAnswered) return std::stoi(result.text);
  PrintError("{}: cut off ({}): {}\n", name, OutcomeOf(result.ending), result.text);
  return 2;
}

}  // namespace

int PrintFromChild(const std::string& name, const ProcessLimits& limits,
                   const std::function<int()>& work) {
  return FromChild(name, limits, work, &PrintText);
}

int TextFromChild(const std::string& name, const ProcessLimits& limits,
                  const std::function<int()>& work, std::string* text) {
  return FromChild(name, limits, work, [text](const std::string& printed) { *text = printed; });
}

}  // namespace loopbench::harness
