// Tables of stores that are too large to be held: written scene by scene.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "harness/cli/commands.h"
#include "harness/store/scene_reader.h"

namespace loopbench::harness {

/// Records of more than a page of anybody's: of runs of a few hundred steps, some 400 MB of memory.
inline constexpr std::size_t kMostHeld = 50'000;

/// CSV or JSON, to standard output or `command.out`, scenes in the order of the store, the rows of
/// each in the usual order, columns as of a table of all. Throws ConfigError for what needs all
/// rows at once.
int WriteLongTable(const TableCommand& command, const SceneReader& reader,
                   const std::string& typed);

/// What LoadRecords() makes of a store, or where these are more than kMostHeld, or than the machine
/// has room for, the store scene by scene.
struct Loaded {
  std::vector<Record> records;
  std::optional<SceneReader> many;
};
Loaded LoadOrScan(const std::filesystem::path& store, const Selection& where);

/// The memory that this process may still take [bytes], by the machine and by its own limit, or
/// with the part that it has already; 0 if it is not known.
double FreeMemory(bool with_own = false);

/// The memory that a store's records may take.
class Room {
 public:
  /// What is free now.
  explicit Room(std::filesystem::path store);
  bool Has(std::uint64_t bytes) const;  ///< for records with lines of so many bytes
  /// Throws ConfigError where it has not; `found`: what they are.
  void Require(const std::string& found, std::uint64_t bytes) const;

 private:
  std::filesystem::path store_;
  double free_ = 0.0;  ///< 0 where that is not known
};

}  // namespace loopbench::harness
