#include "harness/figures/gnuplot.h"

#include <fmt/format.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>

#include "harness/text/escape.h"
#include "harness/text/files.h"
#include "harness/text/memory_file.h"

namespace loopbench::harness {
namespace {

struct ProgramResult {
  int status = 0;  ///< exit status, -1 after a signal
  int error = 0;   ///< errno of a program that could not be started
  std::string output, messages;
};

// `program` from PATH with these arguments, without a shell between.
ProgramResult RunProgram(const std::string& program, const std::string& input) {
  const MemoryFile in("input"), out("output"), messages("messages");
  WriteAll(in.descriptor(), input, "input of " + program);
  ::lseek(in.descriptor(), 0, SEEK_SET);
  posix_spawn_file_actions_t streams;
  ::posix_spawn_file_actions_init(&streams);
  ::posix_spawn_file_actions_adddup2(&streams, in.descriptor(), STDIN_FILENO);
  ::posix_spawn_file_actions_adddup2(&streams, out.descriptor(), STDOUT_FILENO);
  ::posix_spawn_file_actions_adddup2(&streams, messages.descriptor(), STDERR_FILENO);
  // without the settings of the user's own ~/.gnuplot, which would change figures
  std::string name = program, plain = "--default-settings";
  const std::array<char*, 3> arguments = {name.data(), plain.data(), nullptr};
  pid_t child = 0;
  ProgramResult result;
  result.error =
      ::posix_spawnp(&child, program.c_str(), &streams, nullptr, arguments.data(), environ);
  ::posix_spawn_file_actions_destroy(&streams);
  if (result.error != 0) return result;
  int status = 0;
  while (::waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  result.status = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  result.output = out.Text();
  result.messages = messages.Text();
  return result;
}

std::string TerminalOf(const GnuplotPage& page, bool pdf) {
  if (!pdf) {
    return fmt::format("svg noenhanced size {},{} font 'sans-serif,{}' background '#ffffff'",
                       page.width, page.height, page.font);
  }
  return fmt::format("pdfcairo noenhanced size {:.1f}in,{:.1f}in font 'sans-serif,{}'",
                     page.width / 100.0, page.height / 100.0, page.font);
}

}  // namespace

std::optional<std::string> DrawWithGnuplot(const std::filesystem::path& path,
                                           const GnuplotPage& page, const std::string& script,
                                           const std::string& gnuplot) {
  const ProgramResult run = RunProgram(
      gnuplot,
      fmt::format("set terminal {}\n{}", TerminalOf(page, path.extension() == ".pdf"), script));
  if (run.error == ENOENT) {
    return fmt::format("{}: '{}' not found; install gnuplot-nox", path.string(), gnuplot);
  }
  if (run.error != 0) {
    return fmt::format("{}: cannot start '{}': {}", path.string(), gnuplot,
                       std::strerror(run.error));
  }
  if (run.status != 0 || run.output.empty()) {
    return fmt::format("{}: gnuplot failed: {}", path.string(), run.messages);
  }
  WriteFileAtomically(path, run.output);
  return std::nullopt;
}

}  // namespace loopbench::harness
