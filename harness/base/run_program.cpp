#include <fmt/format.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <new>

#include "harness/base/text.h"

namespace loopbench::harness {

MemoryFile::MemoryFile(const char* what) : descriptor_(::memfd_create(what, MFD_CLOEXEC)) {
  if (descriptor_ < 0) FailOn("make in memory", what);
}

MemoryFile::~MemoryFile() { ::close(descriptor_); }

std::string MemoryFile::Text() const {
  std::string text;
  std::array<char, 1 << 16> buffer{};
  for (off_t at = 0;;) {
    const ssize_t count = ::pread(descriptor_, buffer.data(), buffer.size(), at);
    if (count <= 0) return text;
    text.append(buffer.data(), static_cast<std::size_t>(count));
    at += count;
  }
}
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
  std::vector<char*> arguments;
  for (std::string& word : words) arguments.push_back(word.data());
  arguments.push_back(nullptr);
  const MemoryFile fault("errno of exec");
  ProgramResult result;
  const pid_t parent = ::getpid(), child = ::fork();
  if (child == 0) {
    std::signal(SIGTERM, SIG_DFL);  // processes of cases ignore it
    ::prctl(PR_SET_PDEATHSIG, SIGTERM);
    if (::getppid() != parent) ::_exit(EXIT_FAILURE);  // the parent died before the line above
    ::dup2(in.descriptor(), STDIN_FILENO);
    ::dup2(out.descriptor(), STDOUT_FILENO);
    ::dup2(messages.descriptor(), STDERR_FILENO);
    ::execvp(arguments[0], arguments.data());
    const int number = errno;
    ::_exit(::write(fault.descriptor(), &number, sizeof number) < 0 ? 126 : 127);
  }
  if (child < 0) result.error = errno;
  if (child < 0) return result;
  under_way = child;
  int status = 0;
  while (::waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  under_way = 0;
  if (::pread(fault.descriptor(), &result.error, sizeof result.error, 0) > 0) return result;
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
namespace {

int exit_code = 2;
std::string_view last_words;
std::terminate_handler before = nullptr;

void Terminate() {
  if (std::current_exception() != nullptr) {
    try {
      throw;
    } catch (const std::bad_alloc&) {
      [[maybe_unused]] const auto written =
          ::write(STDERR_FILENO, last_words.data(), last_words.size());
      ::_exit(exit_code);
    } catch (...) {  // as before
    }
  }
  before();
}

}  // namespace

void ExitWithoutMemory(int code, std::string_view message) {
  exit_code = code;
  last_words = message;
  const std::terminate_handler known = std::set_terminate(&Terminate);
  if (known != &Terminate) before = known;
}

}  // namespace loopbench::harness
