// A store of records: what a run appends, what readers find, which runs are finished.
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

// The append-only store of results: one JSON object per line.

/// The file of a store: `path` itself if it ends in ".jsonl", else results.jsonl in that folder.
std::filesystem::path StoreFile(const std::filesystem::path& path);

/// Whether the file of a store is so large (32 MiB and more) that nobody should hold all of it:
/// what can be told from a part of it is.
bool IsLarge(const std::filesystem::path& file);

/// Appends records to a file of JSON Lines. Lines are never changed, and a record is on the disk
/// when Append() returns: a crash or a power failure loses at most the line that was being written.
///
/// One process at a time: the file itself is locked, by whatever name it is opened, and the lock
/// goes with the process, however it ends.
class ResultStore {
 public:
  /// Opens `path` for appending and makes missing folders. A path that ends in ".jsonl" is the file
  /// itself; any other path is a folder that holds "results.jsonl". A torn last line, left behind
  /// by a crash, is removed first: the next record would otherwise continue it. Throws
  /// std::runtime_error that names the file, and the process that has the store open. A file that
  /// holds anything but records (and the beginning of one as its last line) is refused with its
  /// line, and stays as it is; of a large one only the end is looked at.
  /// @param waits  while another process has the store open
  explicit ResultStore(const std::filesystem::path& path, bool waits = false);
  ~ResultStore();

  ResultStore(const ResultStore&) = delete;
  ResultStore& operator=(const ResultStore&) = delete;

  /// Writes one line and waits until it is on the disk. Throws std::runtime_error when it could not
  /// be written in full (a full disk, a limit of file sizes); the file is then as it was before.
  /// Throws as well when the file was removed or replaced meanwhile. From any thread.
  void Append(const Record& record) { Append(std::vector<Record>{record}); }

  /// The same with several, all of them or none.
  void Append(const std::vector<Record>& records);

  /// In a forked child: lets go of the store, so that the lock ends with the parent.
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

/// The last record of each case ("case_id"), at the place of its first: what tables show when a
/// case was run again. One of the program `version` comes before those of others, so that going
/// back to a program shows its numbers again. Records without a case_id all stay. Cases of equal
/// keys are told apart (result_store.h).
std::vector<Record> LatestRecords(const std::vector<Record>& records,
                                  std::string_view version = "");

/// All records of a store, `path` as for ResultStore, in the order of the file. Empty lines are
/// passed over. A bad line throws std::runtime_error: file, line number, what was found. The
/// beginning of a record as last line is what a crash leaves; it is skipped and reported in
/// `warnings` (when given).
std::vector<Record> ReadRecords(const std::filesystem::path& path,
                                std::vector<std::string>* warnings = nullptr);

/// Whether conditions choose among the lines of a store: some are on parameters of a sweep.
bool ChoosesLines(const Selection& where);

/// Whether a line may be a record that meets the conditions on parameters of a sweep: a line that
/// does not is passed over without being read.
LineReader::Wanted LinesThatMayMatch(const Selection& where);

/// Told after each record how many there are and how long their lines are together; may throw.
using ReadWatch = std::function<void(std::size_t records, std::uint64_t bytes)>;

/// The same of a store that is too large to be held, without records that conditions on parameters
/// of a sweep exclude: what such a line says besides is not looked at. Parameters are the keys that
/// are nobody else's (FindMeasure() knows none), so that records that decide about each other, of
/// one scene at other tolerances or in other columns, stay or go together. The first record stays,
/// and of each key of the conditions the first that has it: nobody says that no record has it.
std::vector<Record> ReadRecords(const std::filesystem::path& path, const Selection& where,
                                std::vector<std::string>* warnings, const ReadWatch& watch = {});

// Cases that share all keys and differ in what they ran: told apart wherever records are read.

/// The records, and in those that share all their keys (what stands before "case_id") with a record
/// of another case_id "content" and, where one of them has it, "set" (what --set changed) moved
/// before "case_id", among the keys: tables then show both as columns, labels name them. Records
/// without a case_id stay as they are.
std::vector<Record> WithContents(std::vector<Record> records);

/// Tells cases apart in both where one of them has to (WithContents() of each): equal cases then
/// have equal keys.
void ShareContents(std::vector<Record>* one, std::vector<Record>* other);

/// Throws std::runtime_error naming the store and one such case: `command` judges all records that
/// match a rule together, and a rule cannot mean two mechanisms at once.
void RequireOneContent(const std::vector<Record>& records, const std::filesystem::path& store,
                       std::string_view command);

// Which runs a store has, and which of them finished: all that going on with it needs to know.

/// The text under a key of a record's line, read without the rest: it is a flat object in whose
/// texts no quote stands bare. "" when there is none.
/// @param quoted_key  "\"id\":\""
std::string_view TextUnder(std::string_view quoted_key, std::string_view line);

class FinishedRuns {
 public:
  /// `path` as for ResultStore. The store is read when first asked, a line at a time: a hundred
  /// bytes are kept of each record. Throws std::runtime_error then, as ReadRecords() does.
  explicit FinishedRuns(std::filesystem::path path) : path_(std::move(path)) {}

  /// Whether the last run with this "id" finished; nothing when there was none.
  std::optional<bool> Find(const std::string& id);

 private:
  void Read();

  std::filesystem::path path_;
  bool is_read_ = false;
  std::unordered_map<std::uint64_t, bool> finished_;  ///< by the sixteen digits of the id
};

}  // namespace loopbench::harness
