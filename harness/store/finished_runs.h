// Which runs a store has, and which of them finished: all that going on with it needs to know.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <unordered_map>

namespace loopbench::harness {

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
