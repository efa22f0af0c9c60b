// The append-only store of results: one JSON object per line.
#pragma once

#include <filesystem>
#include <mutex>
#include <string>
#include <vector>

#include "harness/record.h"
#include "harness/store/record_json.h"

namespace loopbench::harness {

/// Appends records to a file of JSON Lines. Lines are never changed, and a record is on the disk
/// when Append() returns: a crash or a power failure loses at most the line that was being written.
///
/// One process at a time: a lock on "FILE.lock" goes with the process, however it ends.
class ResultStore {
 public:
  /// Opens `path` for appending and makes missing folders. A path that ends in ".jsonl" is the file
  /// itself; any other path is a folder that holds "results.jsonl". A torn last line, left behind
  /// by a crash, is removed first: the next record would otherwise continue it. Throws
  /// std::runtime_error that names the file, and the process that has the store open.
  explicit ResultStore(const std::filesystem::path& path);
  ~ResultStore();

  ResultStore(const ResultStore&) = delete;
  ResultStore& operator=(const ResultStore&) = delete;

  /// Writes one line and waits until it is on the disk. Throws std::runtime_error when it could not
  /// be written in full (a full disk); the file is then as it was before. From any thread.
  void Append(const Record& record);

  const std::filesystem::path& file() const { return file_; }

 private:
  std::filesystem::path file_;
  int descriptor_ = -1, lock_ = -1;
  std::mutex mutex_;
};

/// The last record of each case ("case_id"), at the place of its first: what tables show when a
/// case was run again. Records without a case_id all stay. Cases of equal keys are told apart
/// (contents.h).
std::vector<Record> LatestRecords(const std::vector<Record>& records);

/// All records of a store, `path` as for ResultStore, in the order of the file. Empty lines are
/// passed over. A bad line throws std::runtime_error: file, line number, what was found. A bad last
/// line without a line end is what a crash leaves; it is skipped and reported in `warnings` (when
/// given).
std::vector<Record> ReadRecords(const std::filesystem::path& path,
                                std::vector<std::string>* warnings = nullptr);

}  // namespace loopbench::harness
