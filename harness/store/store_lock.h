// Stores that no two processes write to, and stores that begin.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

#include "harness/record/record.h"
#include "harness/store/result_store.h"

namespace loopbench::harness {

// Opens a store for one writer at a time.

/// A descriptor of the regular file `file` for reading and appending, made if it is missing, with
/// an exclusive lock on the file itself: by whatever name another process opens it, through a
/// symbolic link or a hard one, it meets the lock. The lock ends when all copies of the descriptor
/// are closed, those of forked children too. Throws std::runtime_error that names the file, and the
/// process that holds the lock.
/// @param waits  for the lock, however long another process holds it
/// @param cure   what to do when another process has it, for the message
int OpenLocked(const std::filesystem::path& file, bool waits = false,
               const std::string& cure = "wait for it (--wait), or write to another --out");

/// Whether a process has the store `file` open for writing.
bool IsLocked(const std::filesystem::path& file);

/// Whether `file` still names what the descriptor is open on: no one deleted or replaced it.
bool IsStillNamed(int descriptor, const std::filesystem::path& file);

// A store that is written once, and is there when all of it is.

/// Where the records stand until the store is whole: beside its file.
std::filesystem::path UnderWay(const std::filesystem::path& store_file);

/// Whether the store has a record. A file that is empty is what a run without one left.
bool HasRecords(const std::filesystem::path& store_file);

/// Records go to UnderWay(), which takes the store's name when all is written: whoever finds the
/// store finds all of it. One process at a time; what one that was killed left is overwritten by
/// the next.
class NewStore {
 public:
  /// `path` as for ResultStore; missing folders are made. Throws std::runtime_error when there are
  /// records, something that is no store, or another process that writes.
  explicit NewStore(const std::filesystem::path& path);
  /// Without Commit() all is as it was before, but for folders that others put something into.
  ~NewStore();
  NewStore(const NewStore&) = delete;
  NewStore& operator=(const NewStore&) = delete;

  void Append(const Record& record);

  /// What belongs to the store is there by now. Nothing can be appended afterwards.
  void Commit();

  const std::filesystem::path& file() const { return file_; }  ///< as it will be

 private:
  void GiveUp();

  std::filesystem::path file_, part_, made_;  ///< made_: the uppermost folder that was missing
  std::optional<ResultStore> empty_;          ///< a file of that name, and its lock
  int descriptor_ = -1;
};

}  // namespace loopbench::harness
