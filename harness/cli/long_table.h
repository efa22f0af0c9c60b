// Tables of stores that are too large to be held: written scene by scene.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>

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

/// Throws ConfigError where the records of a store that meet conditions on its parameters need more
/// memory than the machine has left.
void RequireRoom(const std::filesystem::path& store, const Selection& where);

}  // namespace loopbench::harness
