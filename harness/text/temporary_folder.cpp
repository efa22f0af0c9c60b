#include "harness/text/temporary_folder.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <system_error>
#include <vector>

#include "harness/text/config_error.h"
#include "harness/text/files.h"
#include "harness/text/run_program.h"

namespace loopbench::harness {
namespace {

/// Paths to remove, where a signal handler can read them. Those that find no place are removed by
/// their owner alone.
struct Registered {
  std::atomic<const char*> path = nullptr;
  std::atomic<pid_t> owner = 0;
};
std::array<Registered, 64> registered;

/// Async-signal-safe: another program removes the files.
extern "C" void RemoveAndEnd(int signal) {
  EndProgram();  // it could write more
  std::array<const char*, registered.size() + 4> words = {"rm", "-rf", "--"};
  std::size_t count = 3;
  for (const Registered& one : registered) {
    const char* path = one.path;
    if (path != nullptr && one.owner == ::getpid()) words[count++] = path;
  }
  const pid_t child = count > 3 ? ::_Fork() : -1;
  if (child == 0) {
    ::execv("/bin/rm", const_cast<char**>(words.data()));
    ::_exit(EXIT_FAILURE);
  }
  while (child > 0 && ::waitpid(child, nullptr, 0) < 0 && errno == EINTR) {
  }
  std::signal(signal, SIG_DFL);
  std::raise(signal);
}

void HearSignals() {
  struct sigaction end = {}, before = {};
  end.sa_handler = &RemoveAndEnd;
  end.sa_flags = SA_RESTART;
  const auto signals = {SIGHUP, SIGINT, SIGTERM};
  for (const int signal : signals) ::sigaddset(&end.sa_mask, signal);
  for (const int signal : signals) {
    ::sigaction(signal, nullptr, &before);
    if (before.sa_handler == SIG_DFL) ::sigaction(signal, &end, nullptr);
  }
}

std::filesystem::path FolderOfTemporaries() {
  std::error_code error;
  std::filesystem::path folder = std::filesystem::temp_directory_path(error);
  if (!error) return folder;
  const char* named = std::getenv("TMPDIR");
  throw ConfigError(fmt::format("TMPDIR: found '{}', expected a folder for temporary files: {}",
                                named == nullptr ? "/tmp" : named, error.message()));
}

/// A descriptor of the folder with its lock; -1 if another process has the lock, or removed it.
int LockFolder(const std::filesystem::path& path) {
  const int descriptor = ::open(path.c_str(), O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC);
  struct stat opened = {}, named = {};
  if (descriptor >= 0 && ::flock(descriptor, LOCK_EX | LOCK_NB) == 0 &&
      ::fstat(descriptor, &opened) == 0 && ::stat(path.c_str(), &named) == 0 &&
      opened.st_ino == named.st_ino && opened.st_uid == ::geteuid()) {
    return descriptor;
  }
  if (descriptor >= 0) ::close(descriptor);
  return -1;
}

/// Removes the folders whose process was killed: no process holds their locks.
void RemoveAbandoned(const std::filesystem::path& folder, const std::string& begin) {
  std::error_code ignored;
  std::vector<std::filesystem::path> found;
  for (const auto& entry : std::filesystem::directory_iterator(folder, ignored)) {
    const std::string name = entry.path().filename().string();
    if (name.starts_with(begin) && name.size() == begin.size() + 6) found.push_back(entry.path());
  }
  for (const auto& path : found) {
    const int lock = LockFolder(path);
    if (lock < 0) continue;
    std::filesystem::remove_all(path, ignored);
    ::close(lock);
  }
}

}  // namespace

Unfinished::Unfinished(const std::filesystem::path& path)
    : path_(std::filesystem::absolute(path).string()) {
  for (Registered& one : registered) {
    const char* none = nullptr;
    if (!one.path.compare_exchange_strong(none, path_.c_str())) continue;
    one.owner = ::getpid();
    break;
  }
  HearSignals();
}

Unfinished::~Unfinished() {
  std::error_code ignored;
  std::filesystem::remove_all(path_, ignored);
  for (Registered& one : registered) {
    if (one.path == path_.c_str()) one.path = nullptr;
  }
}

TemporaryFolder::TemporaryFolder(const std::string& name) {
  const std::filesystem::path folder = FolderOfTemporaries();
  const std::string begin = name + ".tmp-";
  RemoveAbandoned(folder, begin);
  // another process may take a folder without a lock for abandoned; not every disk has locks
  for (int i = 0; i < 10 && lock_ < 0; ++i) {
    std::string made = (folder / (begin + "XXXXXX")).string();
    if (::mkdtemp(made.data()) == nullptr) FailOn("make", made);
    unfinished_.emplace(made);
    lock_ = LockFolder(made);
  }
}

TemporaryFolder::~TemporaryFolder() { ::close(lock_); }

}  // namespace loopbench::harness
