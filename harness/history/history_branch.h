// A history that lives on a branch of a git repository of its own: a folder while it is worked on.
#pragma once

#include <filesystem>
#include <string>

namespace loopbench::harness {

/// The branch's files in a temporary folder (git worktree), of the repository that the program was
/// called in.
class HistoryBranch {
 public:
  /// Throws std::runtime_error with what git said, and ConfigError when there is no such branch and
  /// it may not begin.
  /// @param writes  a branch that is not there begins empty; else nothing of the repository
  ///                changes, and several may read at once
  explicit HistoryBranch(std::string branch, bool writes = true);
  ~HistoryBranch();
  HistoryBranch(const HistoryBranch&) = delete;
  HistoryBranch& operator=(const HistoryBranch&) = delete;

  const std::filesystem::path& folder() const { return folder_; }

  /// Commits all changes to the branch; nothing when there are none. Throws as above.
  void Commit(const std::string& message);

 private:
  std::string branch_;
  std::filesystem::path folder_;
};

/// The commit that is checked out and its date (ISO 8601, UTC); "" and "" outside of a repository.
struct CheckedOut {
  std::string commit, date;
};
/// @param commit  another one than that which is checked out, by any name git knows
CheckedOut FindCommit(const std::string& commit = "HEAD");

}  // namespace loopbench::harness
