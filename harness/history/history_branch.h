// A history that lives on a branch of a git repository of its own: a folder while it is worked on.
#pragma once

#include <filesystem>
#include <string>

#include "harness/history/git.h"
#include "harness/text/temporary_folder.h"

namespace loopbench::harness {

/// The branch's files in a temporary folder, of the repository that the program was called in.
/// Nothing of the repository changes before Commit(), and several may be at work at once.
class HistoryBranch {
 public:
  /// Throws ConfigError when there is no such branch and it may not begin, when it is no name of a
  /// branch, or has files but no history.jsonl; std::runtime_error with what git said.
  explicit HistoryBranch(std::string branch, bool may_begin = false);

  const std::filesystem::path& folder() const { return folder_; }

  /// The message with the branch's name in the place of the folder's: "measured:history.jsonl".
  std::string Named(std::string message) const;

  /// Puts all changes onto the branch, which begins here where it is to; nothing when there are
  /// none. False when somebody else changed the branch meanwhile: the changes are then to be made
  /// again, to a new HistoryBranch. Throws ConfigError when the branch is checked out somewhere,
  /// std::runtime_error with what git said.
  bool Commit(const std::string& message);

 private:
  std::string Index() const { return (temporary_.path() / "index").string(); }

  GitRepository git_;
  std::string branch_, at_;  ///< at_: the commit that was read, "" where the branch is to begin
  TemporaryFolder temporary_;
  std::filesystem::path folder_;
};

}  // namespace loopbench::harness
