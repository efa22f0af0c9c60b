// Store of records: a run appends to it, readers read it, finished runs are found in it.
#pragma once

#include <cstdint>
#include <filesystem>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

#include "harness/record/record.h"
#include "harness/record/select.h"
#include "harness/store/record_lines.h"

namespace loopbench::harness {

// Append-only store of results: one JSON object per line.

/// Returns a store's file: `path` itself if it ends in ".jsonl", else results.jsonl in that folder.
std::filesystem::path StoreFile(const std::filesystem::path& path);

/// True if the file of a store is too large to hold in memory (32 MiB and more): readers then use
/// only a part of it if possible.
bool IsLarge(const std::filesystem::path& file);

/// Appends records to a file of JSON Lines. Lines are never changed, and a record is on disk when
/// Append() returns: a crash or a power failure loses at most the current line.
///
/// One process at a time: the file itself is locked, under any name, and the lock ends with the
/// process, however it ends.
class ResultStore {
 public:
  /// Opens `path` for appending and makes missing folders. A path that ends in ".jsonl" is the file
  /// itself; any other path is a folder with "results.jsonl". A torn last line after a crash is
  /// removed first, because the next record would continue it. Throws std::runtime_error with the
  /// file, and the process that has the store open. A file with anything except records (and a torn
  /// last one) is rejected with its line and stays unchanged; of a large file only the end is
  /// checked.
  /// @param waits  wait while another process has the store open
  explicit ResultStore(const std::filesystem::path& path, bool waits = false);
  ~ResultStore();

  ResultStore(const ResultStore&) = delete;
  ResultStore& operator=(const ResultStore&) = delete;

  /// Writes one line and waits until it is on disk. Throws std::runtime_error if it could not be
  /// written completely (a full disk, a limit of file sizes); the file then stays unchanged. Also
  /// throws if the file was removed or replaced meanwhile. Thread-safe.
  void Append(const Record& record) { Append(std::vector<Record>{record}); }

  /// Writes several records, all of them or none.
  void Append(const std::vector<Record>& records);

  /// Releases the store in a forked child, so that the lock ends with the parent.
  void LeaveToParent();

  const std::filesystem::path& file() const { return file_; }
  /// Number of records appended.
  std::size_t appended() const { return appended_; }

 private:
  std::filesystem::path file_;
  int descriptor_ = -1;
  std::size_t appended_ = 0;
  std::mutex mutex_;
};

/// Returns the last record of each case ("case_id"), at the position of its first, for tables of
/// repeated cases. Records of the program `version` precede others, so that a return to an old
/// program shows its numbers. Records without a case_id all stay. Cases of equal keys are
/// distinguished (result_store.h).
std::vector<Record> LatestRecords(const std::vector<Record>& records,
                                  std::string_view version = "");

/// Returns all records of a store, `path` as for ResultStore, in file order. Ignores empty lines. A
/// bad line throws std::runtime_error with file, line number and text. A torn record as last line,
/// left by a crash, is skipped and reported in `warnings` (if given).
std::vector<Record> ReadRecords(const std::filesystem::path& path,
                                std::vector<std::string>* warnings = nullptr);

/// True if conditions select lines of a store: some are on parameters of a sweep.
bool ChoosesLines(const Selection& where);

/// Returns a test whether a line may meet the conditions on parameters of a sweep. Other lines are
/// skipped without parsing.
LineReader::Wanted LinesThatMayMatch(const Selection& where);

/// Called after each record with the number of records and their total line length; may throw.
using ReadWatch = std::function<void(std::size_t records, std::uint64_t bytes)>;

/// Reads a store too large for memory, without the records that conditions on parameters of a sweep
/// exclude; such lines are not parsed further. Parameters are keys unknown to FindMeasure().
/// Records that affect each other (one problem at other tolerances or methods) therefore stay or go
/// together. The first record stays, and the first with each key of the conditions, so that no key
/// seems to be missing.
std::vector<Record> ReadRecords(const std::filesystem::path& path, const Selection& where,
                                std::vector<std::string>* warnings, const ReadWatch& watch = {});

// Cases with equal keys and different contents are distinguished in all readers.

/// Returns the records with additional keys if other case_ids share all their keys (those before
/// "case_id"). "content" and, if one of them has it, "set" (changes by --set) then move before
/// "case_id". Tables show both as columns, labels contain them. Records without a case_id stay
/// unchanged.
std::vector<Record> WithContents(std::vector<Record> records);

/// Applies WithContents() to both lists if one of them needs it: equal cases then have equal keys.
void ShareContents(std::vector<Record>* one, std::vector<Record>* other);

/// Throws std::runtime_error with the store and such a case: `command` judges all records of a rule
/// together, and a rule cannot apply to two mechanisms at once.
void RequireOneContent(const std::vector<Record>& records, const std::filesystem::path& store,
                       std::string_view command);

// Runs in a store and their completion: the data needed to resume it.

/// Returns the text under a key of a record's line without parsing the rest: it is a flat object,
/// and quotes in its texts are escaped. "" if there is none.
/// @param quoted_key  "\"id\":\""
std::string_view TextUnder(std::string_view quoted_key, std::string_view line);

class FinishedRuns {
 public:
  /// `path` as for ResultStore. The first Find() reads the store line by line and keeps about a
  /// hundred bytes of each record. It throws std::runtime_error as ReadRecords() does.
  explicit FinishedRuns(std::filesystem::path path) : path_(std::move(path)) {}

  /// Returns true if the last run with this "id" finished; nothing if there was no run.
  std::optional<bool> Find(const std::string& id);

 private:
  void Read();

  std::filesystem::path path_;
  bool is_read_ = false;
  std::unordered_map<std::uint64_t, bool> finished_;  ///< by the sixteen digits of the id
};

}  // namespace loopbench::harness
