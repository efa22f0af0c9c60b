#include "harness/text/run_program.h"

#include <fmt/format.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <csignal>
#include <cstring>

#include "harness/text/files.h"
#include "harness/text/memory_file.h"

namespace loopbench::harness {
namespace {

std::atomic<pid_t> under_way = 0;

}  // namespace

std::string ProgramResult::Failure(const std::string& name) const {
  if (error == ENOENT) return fmt::format("'{}' not found", name);
  if (error != 0) return fmt::format("cannot start '{}': {}", name, std::strerror(error));
  if (status == 0) return "";
  if (status > 128) return fmt::format("{} was ended by signal {}", name, status - 128);
  return fmt::format("{} failed with exit code {}: {}", name, status, messages);
}

ProgramResult RunProgram(std::vector<std::string> words, const std::string& input) {
  const MemoryFile in("input"), out("output"), messages("messages");
  WriteAll(in.descriptor(), input, "input of " + words.front());
  ::lseek(in.descriptor(), 0, SEEK_SET);
  posix_spawn_file_actions_t streams;
  ::posix_spawn_file_actions_init(&streams);
  ::posix_spawn_file_actions_adddup2(&streams, in.descriptor(), STDIN_FILENO);
  ::posix_spawn_file_actions_adddup2(&streams, out.descriptor(), STDOUT_FILENO);
  ::posix_spawn_file_actions_adddup2(&streams, messages.descriptor(), STDERR_FILENO);
  std::vector<char*> arguments;
  for (std::string& word : words) arguments.push_back(word.data());
  arguments.push_back(nullptr);
  pid_t child = 0;
  ProgramResult result;
  result.error = ::posix_spawnp(&child, arguments[0], &streams, nullptr, arguments.data(), environ);
  ::posix_spawn_file_actions_destroy(&streams);
  if (result.error != 0) return result;
  under_way = child;
  int status = 0;
  while (::waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  under_way = 0;
  result.status = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  result.output = out.Text();
  result.messages = messages.Text();
  return result;
}

void EndProgram() {
  const pid_t child = under_way;
  if (child <= 0) return;
  ::kill(child, SIGTERM);
  while (::waitpid(child, nullptr, 0) < 0 && errno == EINTR) {
  }
}

}  // namespace loopbench::harness
