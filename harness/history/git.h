// Git as the home of a history: commands, branches, places.
#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "harness/text/files.h"
#include "harness/text/run_program.h"

namespace loopbench::harness {

// git, called as a program.

/// The repository that the program was called in. What a hook's variables say (GIT_DIR,
/// GIT_INDEX_FILE, ...) decides which one that is and nothing else: index and work tree are never
/// the user's. No hook runs, and nothing of the user's settings changes what a file holds or which
/// files there are.
class GitRepository {
 public:
  /// Throws ConfigError where there is none, or no git.
  GitRepository();

  /// @param variables  "NAME=value", beside the environment
  /// @param input      what it reads
  ProgramResult Try(const std::vector<std::string>& words,
                    const std::vector<std::string>& variables = {},
                    const std::string& input = "") const;

  /// What it writes, without the line end. Throws std::runtime_error with what git said.
  std::string Get(const std::vector<std::string>& words,
                  const std::vector<std::string>& variables = {},
                  const std::string& input = "") const;

  /// The commit that a branch is at.
  std::optional<std::string> BranchAt(const std::string& branch) const;

  /// The work tree in which a branch is checked out; "" where in none.
  std::string CheckedOutIn(const std::string& branch) const;

  /// Writes the files of a commit into `folder`, byte for byte: no attribute, filter or line end of
  /// the user's has a part in it. What is no regular file stays in the commit alone.
  /// @param index  a file that is not there yet, outside of the folder: for Commit()
  void Export(const std::string& commit, const std::filesystem::path& folder,
              const std::string& index) const;

  /// A new commit on top of `parent` ("": on none) with its files, and with all of `folder` as they
  /// are, however the user ignores, converts or signs; `parent` itself where it has these files
  /// already. Of the user, or of "loopbench" where git knows nobody.
  /// @param index  what Export() made of the parent; where there is none, a file that is not there
  std::string Commit(const std::filesystem::path& folder, const std::string& index,
                     const std::string& parent, const std::string& message) const;

 private:
  std::string folder_;  ///< .git, of all work trees
};

/// The commit that is checked out and its date (ISO 8601, UTC); "" and "" outside of a repository.
struct CheckedOut {
  std::string commit, date;
};
/// @param commit  another commit than the one checked out, by any name that git resolves
/// Throws ConfigError where there is no git.
CheckedOut FindCommit(const std::string& commit = "HEAD");

// A history that lives on a branch of a git repository of its own: a folder while it is worked on.

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

// Where a history lies, as users say it.

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
