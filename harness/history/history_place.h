// Where a history lies, as users say it.
#pragma once

#include <filesystem>
#include <functional>
#include <string>

namespace loopbench::harness {

/// A folder, or a branch of the repository that the program is called in: one of both.
struct HistoryPlace {
  std::filesystem::path store;
  std::string branch;
};

/// A history that is open.
struct OpenHistory {
  std::filesystem::path folder;
  /// A message as users understand it: of a branch its folder is a temporary one.
  std::function<std::string(std::string)> named;
};

/// Calls `read` with the history. What it throws names the branch, not its folder. Throws as
/// HistoryBranch besides, and ConfigError when not exactly one of both is said.
void ReadPlace(const HistoryPlace& place, const std::function<void(const OpenHistory&)>& read);

/// The same for `change`, which says what it did: the message of the branch's commit. It is called
/// again, with what is there then, when somebody else changed the branch meanwhile.
/// @param may_begin  a branch that is not there begins
void ChangePlace(const HistoryPlace& place, bool may_begin,
                 const std::function<std::string(const OpenHistory&)>& change);

}  // namespace loopbench::harness
