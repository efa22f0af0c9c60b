// Stores of records: lines, locks, readers and writers, measurements from any source.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <filesystem>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <unordered_map>
#include <utility>
#include <vector>

#include "harness/base/record.h"

namespace loopbench::harness {

/// Returns the records of a folder with results.jsonl, of a .jsonl file, or of any other file as
/// JSON of Google Benchmark. A case with several records in the store (equal "case_id") is returned
/// once, with its last record. Throws std::runtime_error with the file and its error. Benchmark
/// files have the limits of configurations (ReadTextFile, ParseDocument).
std::vector<Record> ReadMeasurements(const std::filesystem::path& path,
                                     std::vector<std::string>* warnings = nullptr);

/// Returns the runs in the JSON of Google Benchmark, one record per benchmark, kind "benchmark".
/// Keys: "benchmark" (its name), "outcome" ("finished", or the error message), "start_hash" (its
/// label), "series.cpu_ns" and "series.real_ns" (one value per repetition), "cpu_ns" (their
/// median), the counters (median over the repetitions) by name, the origin's keys from the context,
/// and "load_average" (of the minute before). Aggregates, also complexity rows, are left out.
/// `file` is for messages. Throws ConfigError with all deviations from the library's format, each
/// with line, pointer and value, such as a null number or an unknown unit.
std::vector<Record> ParseBenchmarkJson(std::string_view text, const std::string& file);

/// Position of a line in a file, without its line end.
struct LinePlace {
  std::uint64_t offset = 0;
  std::size_t length = 0;
};

/// Takes the lines of a store in sequence and passes on their records.
class LineReader {
 public:
  using Take = std::function<void(Record, const LinePlace&)>;
  /// Returns true if a line is to be read; by default all are. Other lines are not parsed.
  using Wanted = std::function<bool(std::string_view, const LinePlace&)>;

  /// @param file          file name for messages
  /// @param lines_before  number of lines of the file before the first one fed
  LineReader(std::filesystem::path file, Take take, Wanted wanted = {}, int lines_before = 0);

  /// Takes the next part of the text, of any length. Throws std::runtime_error with file, line
  /// number and text for an invalid line, one without values, or one without checksum among others.
  void Feed(std::string_view text);

  /// Ends the text. A last line without line end may be a record, or the torn beginning of one
  /// after a crash, which is skipped and reported in warning().
  void End();

  const std::string& warning() const { return warning_; }
  /// True if lines were written by hand: without a checksum.
  bool is_handmade() const { return first_bare_ > 0; }
  std::uint64_t whole() const { return offset_; }  ///< bytes before a torn last line
  bool is_ended() const { return is_ended_; }      ///< the last record has its line end

 private:
  void TakeLine(std::string_view line);

  std::filesystem::path file_;
  Take take_;
  Wanted wanted_;
  std::string rest_, warning_;  ///< rest_: a line that has begun
  std::uint64_t offset_ = 0;    ///< offset of the current line
  int number_;
  int first_bare_ = 0;  ///< number of the first line without a checksum, or 0
  bool has_sealed_ = false;
  bool is_ended_ = true;
};

/// Reads all records of a store in order, with at most a few megabytes in memory. `path` as for
/// ResultStore. Throws as LineReader does, and if the file cannot be read. A torn last line is
/// reported in `warnings` (if given).
void ForEachRecord(const std::filesystem::path& path, const LineReader::Take& take,
                   std::vector<std::string>* warnings, const LineReader::Wanted& wanted = {});

/// Reads a store too large for memory by problem: warnings compare records of one problem.
class ProblemReader {
 public:
  /// Scans the lines and keeps 16 bytes of each, and about 60 bytes of each problem.
  /// @param path  as for ResultStore
  /// @param where  conditions on parameters of a sweep omit lines, as for ReadRecords()
  ProblemReader(std::filesystem::path path, const Selection& where);

  std::size_t records() const { return lines_.size(); }
  std::uint64_t bytes() const { return bytes_; }  ///< total length of their lines
  /// First record of each set of keys, omitted or not: columns and conditions may use these keys.
  const std::vector<Record>& samples() const { return samples_; }

  /// Passes on all records of several problems at a time, a few thousand, problems in the order of
  /// their first record. A record without a problem comes with others of its case. Throws
  /// std::runtime_error for a line that is no record: file, byte, text found. A torn last line is
  /// reported in `warnings`.
  void ForEach(const std::function<void(std::vector<Record>)>& take,
               std::vector<std::string>* warnings) const;

 private:
  struct Line {
    std::uint64_t offset = 0;
    std::uint32_t length = 0, problem = 0;
  };

  std::filesystem::path file_;
  std::vector<Line> lines_;                ///< ordered by problem
  std::uint64_t bytes_ = 0, last_at_ = 0;  ///< last_at_: offset of the store's last line
  std::vector<Record> samples_;
};

/// Returns the key names of a flat JSON object, each after a '"': they identify kinds of lines.
std::string KeysOfLine(std::string_view line);

/// Several stores of one experiment as one: one record per "id", at the position of its first;
/// records without an id all stay. If a case was run more than once, the last record counts. But a
/// record that the clock or the machine ended (time-limit, crashed, ...) never replaces a complete
/// one.
///
/// Keeps the position of each record, about 280 bytes with its id: 280 MB for a million records.
class MergedStores {
 public:
  /// Reads all stores once. Records of one id come from one program and one case: complete ones
  /// agree in all except times, noise and origin. Throws std::runtime_error with both files, the
  /// case, the key and both values if they do not. Throws as ReadRecords() does, and for a store
  /// whose last line is torn.
  /// @param order  values of "id", each once: these come first, in this order
  MergedStores(const std::vector<std::filesystem::path>& stores,
               const std::vector<std::string>& order = {});
  ~MergedStores();
  MergedStores(const MergedStores&) = delete;
  MergedStores& operator=(const MergedStores&) = delete;

  std::size_t read() const { return read_; }                            ///< records of all stores
  std::size_t size() const { return kept_.size(); }                     ///< records after merging
  const std::vector<std::string>& missing() const { return missing_; }  ///< of `order`, in no store

  /// Reads record `i` from its store.
  Record operator[](std::size_t i) const;

  /// Returns the stores with this run, first the record's own store: their additional files belong
  /// to it. Files of other stores for the case belong to another run.
  std::vector<std::filesystem::path> StoresOf(std::size_t i) const;

 private:
  static constexpr std::size_t kNowhere = static_cast<std::size_t>(-1);
  struct Kept {
    std::size_t part = kNowhere;
    LinePlace place = {};
    bool was_cut_short = false;
    std::vector<std::size_t> equals = {};  ///< earlier parts with the same run
  };
  void Keep(const Record& record, Kept fresh, Kept* known) const;
  Record Read(const Kept& kept) const;
  int Open(std::size_t part) const;

  std::vector<std::filesystem::path> stores_;
  mutable std::deque<std::pair<std::size_t, int>>
      open_;  ///< parts and their descriptors, oldest first
  std::vector<Kept> kept_;
  std::vector<std::string> missing_;
  std::size_t read_ = 0;
};

/// Returns a store's file: `path` itself if it ends in ".jsonl", else results.jsonl in that folder.
std::filesystem::path StoreFile(const std::filesystem::path& path);

/// True for files from 32 MiB on. Readers then load as few records as possible.
bool IsLarge(const std::filesystem::path& file);

/// Appends records to a file of JSON Lines. Lines are never changed, and a record is on disk when
/// Append() returns. One process at a time: the file is locked until the process ends.
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
/// distinguished.
std::vector<Record> LatestRecords(const std::vector<Record>& records,
                                  std::string_view version = "");

/// Returns all records of a store, `path` as for ResultStore, in file order. Ignores empty lines. A
/// bad line throws std::runtime_error with file, line number and text. A torn record as last line,
/// left by a crash, is skipped and reported in `warnings` (if given).
std::vector<Record> ReadRecords(const std::filesystem::path& path,
                                std::vector<std::string>* warnings = nullptr);

/// True if conditions select lines of a store: some are on parameters of a sweep.
bool ChoosesLines(const Selection& where);

/// Returns a test whether a line may meet conditions on parameters of a sweep, without parsing.
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

/// Returns the file of a NewStore's records until it is complete, next to the store's file.
std::filesystem::path UnderWay(const std::filesystem::path& store_file);

/// True if the store has a record. An empty file remains after a run without records.
bool HasRecords(const std::filesystem::path& store_file);

/// Store that appears only when it is complete: records go to UnderWay(), which is then renamed.
/// One process at a time; the next one overwrites the remains of a killed one.
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
