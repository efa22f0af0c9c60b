// Which runs a store has, and which of them finished: all that going on with it needs to know.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <unordered_map>

namespace loopbench::harness {

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
