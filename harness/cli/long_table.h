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

/// Records of more than a page of anybody's: some 400 MB of memory.
inline constexpr std::size_t kMostHeld = 50'000;

/// CSV or JSON, to standard output or `command.out`, scenes in the order of the store, the rows of
/// each in the usual order. The first scenes decide the columns. Throws ConfigError for what needs
/// all rows at once, and where later scenes have other parameters.
int WriteLongTable(const TableCommand& command, const SceneReader& reader,
                   const std::string& typed);

/// LoadRecords() of a store; nothing where they are more than kMostHeld.
std::optional<std::vector<Record>> LoadFew(const std::filesystem::path& store,
                                           const Selection& where);

/// The memory that a store's records may take.
class Room {
 public:
  /// What is free now.
  explicit Room(std::filesystem::path store);
  /// Throws ConfigError where records with lines of so many bytes have none; `found`: what they
  /// are.
  void Require(const std::string& found, std::uint64_t bytes) const;

 private:
  std::filesystem::path store_;
  double free_ = 0.0;  ///< 0 where that is not known
};

}  // namespace loopbench::harness
