#include "harness/store/new_store.h"

#include <fmt/format.h>
#include <unistd.h>

#include <stdexcept>

#include "harness/record/record_json.h"
#include "harness/store/store_lock.h"
#include "harness/text/files.h"
#include "harness/text/output_file.h"

namespace loopbench::harness {
namespace {

namespace fs = std::filesystem;

/// The uppermost folder above `file` that is missing, or "".
fs::path FirstMissingAbove(const fs::path& file) {
  fs::path missing;
  for (fs::path folder = file.parent_path(); !folder.empty() && !fs::exists(folder);
       folder = folder.parent_path()) {
    missing = folder;
  }
  return missing;
}

/// Throws where it is a link that leads in a circle, or into a folder that is not there: its disk
/// may be missing, so none is made.
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
    // another process may have ended between the look at the store and the lock
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
