// Exclusive writer lock of a store, and new stores.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

#include "harness/record/record.h"
#include "harness/store/result_store.h"

namespace loopbench::harness {

// Opens a store for one writer at a time.

/// Returns a descriptor of the regular file `file` for reading and appending; makes the file if it
/// is missing. The exclusive lock is on the file itself, so it also applies through symbolic and
/// hard links. It ends when all copies of the descriptor are closed, also in forked children.
/// Throws std::runtime_error with the file and the process that holds the lock.
/// @param waits  wait for the lock, however long another process holds it
/// @param cure   remedy for the message if another process has it
int OpenLocked(const std::filesystem::path& file, bool waits = false,
               const std::string& cure = "wait for it (--wait), or write to another --out");

/// True if a process has the store `file` open for writing.
bool IsLocked(const std::filesystem::path& file);

/// True if `file` still names the open file of the descriptor: it was not deleted or replaced.
bool IsStillNamed(int descriptor, const std::filesystem::path& file);

// Store that is written once and appears only when it is complete.

/// Returns the file of the records until the store is complete, next to the store's file.
std::filesystem::path UnderWay(const std::filesystem::path& store_file);

/// True if the store has a record. An empty file remains after a run without records.
bool HasRecords(const std::filesystem::path& store_file);

/// Writes records to UnderWay(), which is renamed to the store's file when complete: readers never
/// find a partial store. One process at a time; the next one overwrites the remains of a killed
/// one.
class NewStore {
 public:
  /// `path` as for ResultStore; makes missing folders. Throws std::runtime_error if there are
  /// records, a file that is no store, or another writing process.
  explicit NewStore(const std::filesystem::path& path);
  /// Restores the previous state unless Commit() was called; folders with new files of others stay.
  ~NewStore();
  NewStore(const NewStore&) = delete;
  NewStore& operator=(const NewStore&) = delete;

  void Append(const Record& record);

  /// Completes the store, after all its additional files exist. Nothing can be appended afterwards.
  void Commit();

  const std::filesystem::path& file() const { return file_; }  ///< final name

 private:
  void GiveUp();

  std::filesystem::path file_, part_, made_;  ///< made_: topmost folder that was missing
  std::optional<ResultStore> empty_;          ///< a file of that name, and its lock
  int descriptor_ = -1;
};

}  // namespace loopbench::harness
