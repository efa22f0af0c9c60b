// Lines of a store: written, read back, and read problem by problem if memory is scarce.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <filesystem>
#include <functional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "harness/record/record.h"
#include "harness/record/select.h"

namespace loopbench::harness {

// Reads the records of a store one at a time, for stores of a million records.

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
  /// number and text for an invalid line, or one without checksum among lines with one. Ignores
  /// empty lines.
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

// Reads a store too large for memory, problem by problem: warnings compare only records of one
// problem.

class ProblemReader {
 public:
  /// Scans the lines and keeps 16 bytes of each, and about 60 bytes of each problem.
  /// @param path  as for ResultStore
  /// @param where  conditions on parameters of a sweep omit lines, as for ReadRecords()
  ProblemReader(std::filesystem::path path, const Selection& where);

  std::size_t records() const { return lines_.size(); }
  std::uint64_t bytes() const { return bytes_; }  ///< total length of their lines
  /// First record of each set of keys in the store, omitted or not: columns and conditions may use
  /// these keys.
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

// Merges several stores of one experiment into one: every case once.

/// One record per "id", at the position of its first; records without an id all stay. If a case was
/// run more than once, the last record counts. But a record that the clock or the machine ended
/// (time-limit, crashed, ...) never replaces a complete one.
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

}  // namespace loopbench::harness
