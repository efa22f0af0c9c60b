// The records of a store that is too large to be held, scene by scene: what records say about each
// other, such as doubts, they say within one.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "harness/record/record.h"
#include "harness/record/select.h"

namespace loopbench::harness {

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

}  // namespace loopbench::harness
