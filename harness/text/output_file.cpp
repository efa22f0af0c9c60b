#include "harness/text/output_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <mutex>
#include <set>
#include <stdexcept>
#include <utility>
#include <vector>

#include "harness/text/files.h"

namespace loopbench::harness {
namespace {

namespace fs = std::filesystem;

using FileId = std::pair<dev_t, ino_t>;

FileId IdOf(const struct stat& status) { return {status.st_dev, status.st_ino}; }

/// By device and number of the file: paths and links that lead to one file are one input.
struct Inputs {
  std::mutex mutex;
  bool are_noted = false;
  std::set<FileId> files;
};
Inputs inputs;

[[noreturn]] void Refuse(const fs::path& path, std::string_view found) {
  throw std::runtime_error(
      fmt::format("cannot write '{}': found {}, expected a file that can be replaced, a pipe or a "
                  "character device",
                  path.string(), found));
}

/// Where output to a path goes.
struct Destination {
  fs::path target = {};  ///< behind links; "" if it goes into the existing file
  int stream = -1;       ///< a standard stream that the path leads to
  mode_t mode = 0;       ///< of a file that is there
};

Destination DestinationOf(const fs::path& path, Onto onto) {
  struct stat there = {}, other = {};
  if (::stat(path.c_str(), &there) != 0) {
    if (errno != ENOENT) FailOn("write", path);
    return {.target = BehindLinks(path)};
  }
  if (S_ISDIR(there.st_mode)) Refuse(path, "a folder");
  if (!S_ISREG(there.st_mode) && !S_ISCHR(there.st_mode) && !S_ISFIFO(there.st_mode)) {
    Refuse(path, S_ISBLK(there.st_mode) ? "a block device" : "a socket");
  }
  for (const int stream : {STDOUT_FILENO, STDERR_FILENO}) {
    if (::fstat(stream, &other) == 0 && IdOf(other) == IdOf(there)) return {.stream = stream};
  }
  if (!S_ISREG(there.st_mode)) return {};
  {
    const std::lock_guard lock(inputs.mutex);
    if (onto == Onto::kNoInput && inputs.files.contains(IdOf(there))) {
      Refuse(path, "an input of this command");
    }
  }
  if (::access(path.c_str(), W_OK) != 0) FailOn("write", path);
  const fs::path target = BehindLinks(path);
  // a file that only /proc names, such as one that was removed
  if (::stat(target.c_str(), &other) != 0 || IdOf(other) != IdOf(there)) return {};
  return {.target = target, .mode = there.st_mode & 07777};
}

/// A name that no other thread or process uses.
fs::path PartBeside(fs::path target, std::string_view ending) {
  static std::atomic<int> counter{0};
  target += ending.empty() ? fmt::format(".{}-{}.tmp", ::getpid(), counter++) : std::string(ending);
  return target;
}

/// Whether PartBeside() made the name in a process of this machine that has ended, or elsewhere.
bool IsOfEndedProcess(const std::string& name) {
  const std::size_t begin = name.rfind('.', name.size() - std::min<std::size_t>(name.size(), 5));
  int pid = 0, number = 0, length = 0;
  if (begin == std::string::npos) return false;
  const char* ending = name.c_str() + begin;
  const int found = std::sscanf(ending, ".%d-%d.tmp%n", &pid, &number, &length);
  return found == 2 && begin + static_cast<std::size_t>(length) == name.size() && pid > 0 &&
         ::kill(pid, 0) != 0 && errno == ESRCH;
}

}  // namespace

CommandInputs::CommandInputs() { inputs.are_noted = true; }

CommandInputs::~CommandInputs() {
  inputs.are_noted = false;
  inputs.files.clear();
}

void NoteInput(const fs::path& path) {
  struct stat status = {};
  const std::lock_guard lock(inputs.mutex);
  if (!inputs.are_noted || ::stat(path.c_str(), &status) != 0) return;
  inputs.files.insert(IdOf(status));
}

void RequireOutput(const fs::path& path) {
  const Destination destination = DestinationOf(path, Onto::kNoInput);
  if (destination.target.empty()) return;
  MakeFolderOf(path);
  const fs::path folder = destination.target.parent_path();
  if (::access(folder.empty() ? "." : folder.c_str(), W_OK) != 0) FailOn("write", path);
}

fs::path BehindLinks(fs::path file) {
  constexpr int kMostLinks = 40;  // as the system has it
  for (int i = 0; i < kMostLinks && fs::is_symlink(fs::symlink_status(file)); ++i) {
    file = file.parent_path() / fs::read_symlink(file);
  }
  return file;
}

void RemoveAbandoned(const fs::path& folder) {
  std::error_code ignored;
  std::vector<fs::path> found;
  for (const auto& entry : fs::directory_iterator(folder, ignored)) {
    if (IsOfEndedProcess(entry.path().filename().string())) found.push_back(entry.path());
  }
  for (const fs::path& path : found) {
    const int descriptor = ::open(path.c_str(), O_RDONLY | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC);
    if (descriptor < 0) continue;
    if (::flock(descriptor, LOCK_EX | LOCK_NB) == 0) fs::remove(path, ignored);
    ::close(descriptor);
  }
}

OutputFile::OutputFile(const fs::path& path, Onto onto, std::string_view ending) : path_(path) {
  MakeFolderOf(path);
  Destination destination = DestinationOf(path, onto);
  target_ = std::move(destination.target);
  if (destination.stream >= 0) {
    std::fflush(nullptr);
    descriptor_ = ::fcntl(destination.stream, F_DUPFD_CLOEXEC, 0);
  } else if (target_.empty()) {
    descriptor_ = ::open(path.c_str(), O_WRONLY | O_TRUNC | O_CLOEXEC);
  } else {
    constexpr int kMode = 0644;
    part_.emplace(PartBeside(target_, ending));
    descriptor_ = ::open(part_->path().c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, kMode);
    if (descriptor_ >= 0 && destination.mode != 0) ::fchmod(descriptor_, destination.mode);
    if (descriptor_ >= 0) ::flock(descriptor_, LOCK_EX | LOCK_NB);  // for RemoveAbandoned()
  }
  if (descriptor_ < 0) FailOn("write", path_);
}

OutputFile::~OutputFile() { Close(); }

void OutputFile::Close() {
  if (descriptor_ >= 0) ::close(std::exchange(descriptor_, -1));
}

void OutputFile::Write(std::string_view text) { WriteAll(descriptor_, text, path_); }

void OutputFile::Finish() {
  if (part_) {
    if (::fsync(descriptor_) != 0) FailOn("write", path_);
    if (::rename(part_->path().c_str(), target_.c_str()) != 0) FailOn("write", path_);
    SyncFolderOf(target_);
  }
  Close();
}

bool OutputFile::FinishIfNew() {
  if (!part_) return false;
  if (::fsync(descriptor_) != 0) FailOn("write", path_);
  const std::string part = part_->path().string();
  int failure = ::link(part.c_str(), path_.c_str()) == 0 ? 0 : errno;
  if (failure == EPERM || failure == EOPNOTSUPP) {  // a file has one name there
    const bool done =
        ::renameat2(AT_FDCWD, part.c_str(), AT_FDCWD, path_.c_str(), RENAME_NOREPLACE) == 0;
    failure = done ? 0 : errno;
  }
  errno = failure;
  if (failure != 0 && failure != EEXIST) FailOn("write", path_);
  SyncFolderOf(path_);
  Close();
  return failure == 0;
}

}  // namespace loopbench::harness
