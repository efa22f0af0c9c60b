#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <fstream>
#include <sstream>
#include <thread>

#include "harness/base/store.h"
#include "harness/base/text.h"

namespace loopbench::harness {
namespace {

/// Returns the process that locked the file, or "another process" if the system gives none.
std::string Holder(int descriptor) {
  struct stat status = {};
  if (::fstat(descriptor, &status) != 0) return "another process";
  const std::string inode = fmt::format(":{}", status.st_ino);
  // a list that changes during reading may miss a line
  for (int look = 0; look < 3; ++look) {
    std::ifstream locks("/proc/locks");
    for (std::string line; std::getline(locks, line);) {
      // 1: FLOCK  ADVISORY  WRITE 1234 fe:00:5341448 0 EOF
      std::istringstream words(line);
      std::string number, kind, mode, access, process, file;
      words >> number >> kind >> mode >> access >> process >> file;
      if (kind == "FLOCK" && file.ends_with(inode)) return "process " + process;
    }
  }
  return "another process";
}

/// Number of tries: child processes of a killed process close its descriptors in less time.
constexpr int kTries = 10;
constexpr std::chrono::milliseconds kBetweenTries{20};

bool TryLock(int descriptor, const std::filesystem::path& file, bool waits) {
  if (waits && ::flock(descriptor, LOCK_EX) == 0) return true;
  for (int i = 0; i < kTries; ++i) {
    if (::flock(descriptor, LOCK_EX | LOCK_NB) == 0) return true;
    if (errno != EWOULDBLOCK && errno != EINTR) FailOn("lock", file);
    std::this_thread::sleep_for(kBetweenTries);
  }
  return false;
}

namespace fs = std::filesystem;

/// Returns the topmost missing folder above `file`, or "".
fs::path FirstMissingAbove(const fs::path& file) {
  fs::path missing;
  for (fs::path folder = file.parent_path(); !folder.empty() && !fs::exists(folder);
       folder = folder.parent_path()) {
    missing = folder;
  }
  return missing;
}

/// Throws for a circular link, or one into a missing folder: its disk may be missing.
void RequireTarget(const fs::path& file) {
  if (!fs::is_symlink(fs::symlink_status(file))) return;
  const fs::path target = BehindLinks(file);
  const bool is_circle = fs::is_symlink(fs::symlink_status(target));
  if (!is_circle && fs::is_directory(fs::absolute(target).parent_path())) return;
  throw std::runtime_error(
      fmt::format("{}: found a symbolic link {}, expected a file or a new name", file.string(),
                  is_circle ? "in a circle of them"
                            : fmt::format("to {}, whose folder is not there", target.string())));
}

}  // namespace

int OpenLocked(const std::filesystem::path& file, bool waits, const std::string& cure) {
  constexpr int kMode = 0644;
  for (int i = 0; i < kTries; ++i) {
    // non-blocking: a pipe of that name would wait for its other end
    const int descriptor =
        ::open(file.c_str(), O_RDWR | O_APPEND | O_CREAT | O_CLOEXEC | O_NONBLOCK, kMode);
    if (descriptor < 0) FailOn("open", file);
    try {
      struct stat status = {};
      if (::fstat(descriptor, &status) != 0) FailOn("open", file);
      if (!S_ISREG(status.st_mode)) {
        throw std::runtime_error(
            fmt::format("'{}': expected a regular file for a store", file.string()));
      }
      if (!TryLock(descriptor, file, waits)) {
        throw std::runtime_error(
            fmt::format("'{}' is in use by {}; {}", file.string(), Holder(descriptor), cure));
      }
      if (IsStillNamed(descriptor, file)) return descriptor;
    } catch (...) {
      ::close(descriptor);
      throw;
    }
    ::close(descriptor);  // replaced between opening and locking
  }
  throw std::runtime_error(fmt::format(
      "'{}' is another file each time it is opened, expected one that stays", file.string()));
}

bool IsLocked(const std::filesystem::path& file) {
  const int descriptor = ::open(file.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
  if (descriptor < 0) return false;
  const bool is_locked = ::flock(descriptor, LOCK_SH | LOCK_NB) != 0 && errno == EWOULDBLOCK;
  ::close(descriptor);
  return is_locked;
}

bool IsStillNamed(int descriptor, const std::filesystem::path& file) {
  struct stat opened = {}, named = {};
  return ::fstat(descriptor, &opened) == 0 && ::stat(file.c_str(), &named) == 0 &&
         opened.st_dev == named.st_dev && opened.st_ino == named.st_ino;
}

fs::path UnderWay(const fs::path& store_file) {
  fs::path part = BehindLinks(store_file);
  part += ".merging";
  return part;
}

bool HasRecords(const fs::path& store_file) {
  std::error_code error;
  const std::uintmax_t size = fs::file_size(store_file, error);
  return !error && size > 0;
}

NewStore::NewStore(const fs::path& path) : file_(StoreFile(path)), part_(UnderWay(file_)) {
  RequireTarget(file_);
  if (fs::exists(file_)) {
    empty_.emplace(file_);
    if (HasRecords(file_)) {
      throw std::runtime_error(
          fmt::format("{}: found records, expected a new store; name it among the "
                      "stores to merge and write to another",
                      file_.string()));
    }
  }
  made_ = FirstMissingAbove(file_);
  MakeFolderOf(file_);
  descriptor_ = OpenLocked(part_, false, "it writes the same store: wait for it");
  try {
    if (::ftruncate(descriptor_, 0) != 0) FailOn("write", part_);
    // another process may have ended between the check of the store and the lock
    if (!empty_ && HasRecords(file_)) {
      throw std::runtime_error(
          fmt::format("{}: was written by another process just now", file_.string()));
    }
  } catch (...) {
    GiveUp();
    throw;
  }
}

NewStore::~NewStore() { GiveUp(); }

void NewStore::GiveUp() {
  if (descriptor_ < 0) return;
  std::error_code ignored;
  fs::remove(part_, ignored);
  ::close(descriptor_);
  descriptor_ = -1;
  if (made_.empty()) return;
  for (fs::path folder = file_.parent_path(); fs::remove(folder, ignored) && folder != made_;) {
    folder = folder.parent_path();
  }
}

void NewStore::Append(const Record& record) {
  WriteAll(descriptor_, ToJsonLine(record) + '\n', part_);
}

void NewStore::Commit() {
  if (::fsync(descriptor_) != 0) FailOn("write", part_);
  const fs::path target = BehindLinks(file_);
  std::error_code error;
  fs::rename(part_, target, error);
  if (error) {
    errno = error.value();
    FailOn("write", file_);
  }
  SyncFolderOf(target);
  ::close(descriptor_);
  descriptor_ = -1;
  empty_.reset();
}

}  // namespace loopbench::harness
