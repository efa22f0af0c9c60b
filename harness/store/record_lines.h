// The records of a store, one at a time: what a million of them are read with.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "harness/record/record.h"

namespace loopbench::harness {

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

}  // namespace loopbench::harness
