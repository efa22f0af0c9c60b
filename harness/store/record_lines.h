// Lines of a store: written, read back, scene by scene where memory is scarce.
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

// The records of a store, one at a time: what a million of them are read with.

/// A line of a file, without its end.
struct LinePlace {
  std::uint64_t offset = 0;
  std::size_t length = 0;
};

/// Takes the lines of a store as they come, and gives the records in them.
class LineReader {
 public:
  using Take = std::function<void(Record, const LinePlace&)>;
  /// Of a line, whether it is read; without one all are. What is passed over is not looked at.
  using Wanted = std::function<bool(std::string_view, const LinePlace&)>;

  /// @param file          for messages
  /// @param lines_before  of the file, that are not fed
  LineReader(std::filesystem::path file, Take take, Wanted wanted = {}, int lines_before = 0);

  /// The next part of the text, of any length. Throws std::runtime_error for a line that is no
  /// record, and for a line without a checksum beside lines that have one: file, line number, text
  /// found. Empty lines are passed over.
  void Feed(std::string_view text);

  /// Behind the last part: a line without an end may be a record, or the beginning of one that a
  /// crash left, which is skipped and said in warning().
  void End();

  const std::string& warning() const { return warning_; }
  /// Whether lines were made by hand: without a checksum.
  bool is_handmade() const { return first_bare_ > 0; }
  std::uint64_t whole() const { return offset_; }  ///< bytes before a torn last line
  bool is_ended() const { return is_ended_; }      ///< the last record has its line end

 private:
  void TakeLine(std::string_view line);

  std::filesystem::path file_;
  Take take_;
  Wanted wanted_;
  std::string rest_, warning_;  ///< rest_: a line that has begun
  std::uint64_t offset_ = 0;    ///< of the line that is taken
  int number_;
  int first_bare_ = 0;  ///< number of the first line without a checksum, or 0
  bool has_sealed_ = false;
  bool is_ended_ = true;
};

/// All of a store's, in its order, never more than a few megabytes at once. `path` as for
/// ResultStore. Throws as LineReader does, and when the file cannot be read; a torn last line is
/// told in `warnings` (when given).
void ForEachRecord(const std::filesystem::path& path, const LineReader::Take& take,
                   std::vector<std::string>* warnings, const LineReader::Wanted& wanted = {});

// The records of a store that is too large to be held, scene by scene: what records say about each
// other, such as doubts, they say within one.

class SceneReader {
 public:
  /// Looks through the lines and keeps sixteen bytes of each, and some sixty of each scene.
  /// @param path  as for ResultStore
  /// @param where  conditions on parameters of a sweep leave lines out, as for ReadRecords()
  SceneReader(std::filesystem::path path, const Selection& where);

  std::size_t records() const { return lines_.size(); }
  std::uint64_t bytes() const { return bytes_; }  ///< of their lines
  /// The first record of each set of keys in the store, left out or not: what columns and
  /// conditions can be about.
  const std::vector<Record>& samples() const { return samples_; }

  /// All records of some scenes at a time, a few thousand, scenes in the order in which they begin
  /// in the store. A record without a scene comes with those of its case. Throws
  /// std::runtime_error for a line that is no record: file, byte, what was found; a torn last line
  /// is told in `warnings`.
  void ForEach(const std::function<void(std::vector<Record>)>& take,
               std::vector<std::string>* warnings) const;

 private:
  struct Line {
    std::uint64_t offset = 0;
    std::uint32_t length = 0, scene = 0;
  };

  std::filesystem::path file_;
  std::vector<Line> lines_;                ///< by scene
  std::uint64_t bytes_ = 0, last_at_ = 0;  ///< last_at_: offset of the store's last line
  std::vector<Record> samples_;
};

/// The names of the keys of a flat JSON object, each behind a '"': what tells kinds of lines apart.
std::string KeysOfLine(std::string_view line);

// Several stores of one experiment into one: every case once.

/// One record per "id", at the place of its first; records without one all stay. Of a case that was
/// run more than once a record whose ending the clock or the machine decided (time-limit, crashed,
/// ...) gives way to one that was not, and else to the last.
///
/// Of each record its place is kept, some 280 bytes with its id: a million of them are merged in as
/// many megabytes.
class MergedStores {
 public:
  /// Reads all of the stores once. Records of one id come from one program and one case: two that
  /// were not cut short agree in all but times, noise and origin. Throws std::runtime_error that
  /// names both files, the case, the key and both values where they do not, as ReadRecords() does,
  /// and for a store whose last line is torn.
  /// @param order  "id"s, each once: these first, in this order
  MergedStores(const std::vector<std::filesystem::path>& stores,
               const std::vector<std::string>& order = {});
  ~MergedStores();
  MergedStores(const MergedStores&) = delete;
  MergedStores& operator=(const MergedStores&) = delete;

  std::size_t read() const { return read_; }                            ///< records of all stores
  std::size_t size() const { return kept_.size(); }                     ///< that are left
  const std::vector<std::string>& missing() const { return missing_; }  ///< of `order`, in no store

  /// Reads the record from its store.
  Record operator[](std::size_t i) const;

  /// The stores whose run this is, that of the record first: what they keep beside their records
  /// belongs to it, and what other stores keep of the case is another run's.
  std::vector<std::filesystem::path> StoresOf(std::size_t i) const;

 private:
  static constexpr std::size_t kNowhere = static_cast<std::size_t>(-1);
  struct Kept {
    std::size_t part = kNowhere;
    LinePlace place = {};
    bool was_cut_short = false;
    std::vector<std::size_t> equals = {};  ///< parts before it with the same run
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
