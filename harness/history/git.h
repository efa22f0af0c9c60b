// Git as storage of a history: commands, branches, locations.
#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "harness/text/files.h"
#include "harness/text/run_program.h"

namespace loopbench::harness {

// The git program.

/// Git repository of the current directory. Variables of a hook (GIT_DIR, GIT_INDEX_FILE, ...) only
/// select this repository: the user's index and work tree are never used. Hooks do not run. User
/// settings cannot change file contents or the set of files.
class GitRepository {
 public:
  /// Throws ConfigError if there is no repository or no git.
  GitRepository();

  /// @param variables  "NAME=value", in addition to the environment
  /// @param input      standard input
  ProgramResult Try(const std::vector<std::string>& words,
                    const std::vector<std::string>& variables = {},
                    const std::string& input = "") const;

  /// Returns the output without the line end. Throws std::runtime_error with the message of git.
  std::string Get(const std::vector<std::string>& words,
                  const std::vector<std::string>& variables = {},
                  const std::string& input = "") const;

  /// Returns the commit of a branch.
  std::optional<std::string> BranchAt(const std::string& branch) const;

  /// Returns the work tree in which a branch is checked out; "" if none.
  std::string CheckedOutIn(const std::string& branch) const;

  /// Writes the regular files of a commit into `folder`, byte for byte: attributes, filters and
  /// line-end settings of the user have no effect. Other entries are not written.
  /// @param index  a file that does not exist yet, outside of the folder: for Commit()
  void Export(const std::string& commit, const std::filesystem::path& folder,
              const std::string& index) const;

  /// Returns a new commit on top of `parent` ("": no parent) with its files and all of `folder`,
  /// unchanged by ignore, conversion or signature settings. Returns `parent` if nothing changed.
  /// The author is the user, or "loopbench" if git has no user.
  /// @param index  file made by Export() for the parent; without a parent, a file that does not
  /// exist
  std::string Commit(const std::filesystem::path& folder, const std::string& index,
                     const std::string& parent, const std::string& message) const;

 private:
  std::string folder_;  ///< .git, common to all work trees
};

/// Checked-out commit and its date (ISO 8601, UTC); both "" outside of a repository.
struct CheckedOut {
  std::string commit, date;
};
/// @param commit  a commit in any notation of git
/// Throws ConfigError if there is no git.
CheckedOut FindCommit(const std::string& commit = "HEAD");

// A history on a branch of its own in a git repository, edited in a folder.

/// Files of a branch of the current repository, in a temporary folder. The repository changes only
/// in Commit(). Several processes may work at once.
class HistoryBranch {
 public:
  /// Throws ConfigError if the branch is absent and `may_begin` is false, if its name is invalid,
  /// or if it has files but no history.jsonl. Throws std::runtime_error with the message of git.
  explicit HistoryBranch(std::string branch, bool may_begin = false);

  const std::filesystem::path& folder() const { return folder_; }

  /// Returns the message with the branch in place of the folder: "measured:history.jsonl".
  std::string Named(std::string message) const;

  /// Commits all changes to the branch, and creates it if necessary; does nothing without changes.
  /// Returns false if another process has changed the branch: repeat the changes in a new
  /// HistoryBranch. Throws ConfigError if the branch is checked out anywhere, and
  /// std::runtime_error with the message of git.
  bool Commit(const std::string& message);

 private:
  std::string Index() const { return (temporary_.path() / "index").string(); }

  GitRepository git_;
  std::string branch_, at_;  ///< at_: the commit that was read, "" for a new branch
  TemporaryFolder temporary_;
  std::filesystem::path folder_;
};

// Location of a history, as given by users.

/// Either a folder or a branch of the current repository.
struct HistoryPlace {
  std::filesystem::path store;
  std::string branch;
};

/// An open history.
struct OpenHistory {
  std::filesystem::path folder;
  /// Rewrites a message for users: for a branch, the folder is temporary.
  std::function<std::string(std::string)> named;
};

/// Calls `read` with the history. Errors contain the branch instead of its folder. Throws as
/// HistoryBranch, and ConfigError unless exactly one of both is given.
void ReadPlace(const HistoryPlace& place, const std::function<void(const OpenHistory&)>& read);

/// Calls `change`, which returns the commit message for the branch. If another process has changed
/// the branch meanwhile, calls it again on the new state.
/// @param may_begin  creates an absent branch
void ChangePlace(const HistoryPlace& place, bool may_begin,
                 const std::function<std::string(const OpenHistory&)>& change);

}  // namespace loopbench::harness
