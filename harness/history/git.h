// git, called as a program.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "harness/text/run_program.h"

namespace loopbench::harness {

/// The repository that the program was called in. What a hook's variables say (GIT_DIR,
/// GIT_INDEX_FILE, ...) decides which one that is and nothing else: index and work tree are never
/// the user's. No hook runs, and nothing of the user's settings changes what a file holds or which
/// files there are.
class GitRepository {
 public:
  /// Throws ConfigError where there is none, or no git.
  GitRepository();

  /// @param variables  "NAME=value", beside the environment
  ProgramResult Try(const std::vector<std::string>& words,
                    const std::vector<std::string>& variables = {}) const;

  /// What it writes, without the line end. Throws std::runtime_error with what git said.
  std::string Get(const std::vector<std::string>& words,
                  const std::vector<std::string>& variables = {}) const;

  /// The commit that a branch is at.
  std::optional<std::string> BranchAt(const std::string& branch) const;

  /// The work tree in which a branch is checked out; "" where in none.
  std::string CheckedOutIn(const std::string& branch) const;

  /// A new commit with all files of `folder`, however the user ignores or signs, on top of `parent`
  /// ("": on none); `parent` itself where it has these files already. Of the user, or of
  /// "loopbench" where git knows nobody.
  /// @param index  a file that is not there yet, outside of the folder
  std::string Commit(const std::string& folder, const std::string& index, const std::string& parent,
                     const std::string& message) const;

 private:
  std::string folder_;  ///< .git, of all work trees
};

/// The commit that is checked out and its date (ISO 8601, UTC); "" and "" outside of a repository.
struct CheckedOut {
  std::string commit, date;
};
/// @param commit  another one than that which is checked out, by any name git knows
CheckedOut FindCommit(const std::string& commit = "HEAD");

}  // namespace loopbench::harness
