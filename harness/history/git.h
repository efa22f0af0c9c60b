// git, called as a program.
#pragma once

#include <filesystem>
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

}  // namespace loopbench::harness
