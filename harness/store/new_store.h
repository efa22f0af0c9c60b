// A store that is written once, and is there when all of it is.
#pragma once

#include <filesystem>
#include <optional>
#include <string_view>

#include "harness/record/record.h"
#include "harness/store/result_store.h"

namespace loopbench::harness {

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
