#include "harness/history/history_branch.h"

#include <fmt/format.h>
#include <stdlib.h>

#include <stdexcept>
#include <utility>
#include <vector>

#include "harness/text/config_error.h"
#include "harness/text/files.h"
#include "harness/text/run_program.h"

namespace loopbench::harness {
namespace {

std::string Git(std::vector<std::string> words) {
  words.insert(words.begin(), "git");
  ProgramResult result = RunProgram(std::move(words));
  if (const std::string failure = result.Failure("git"); !failure.empty()) {
    throw std::runtime_error(failure);
  }
  while (!result.output.empty() && result.output.back() == '\n') result.output.pop_back();
  return result.output;
}

bool HasBranch(const std::string& branch) {
  return RunProgram({"git", "rev-parse", "--verify", "--quiet", "refs/heads/" + branch}).status ==
         0;
}

}  // namespace

HistoryBranch::HistoryBranch(std::string branch, bool writes) : branch_(std::move(branch)) {
  if (!writes && !HasBranch(branch_)) {
    throw ConfigError(fmt::format(
        "found no branch \"{0}\" in a git repository here, expected a history; loopbench history "
        "add begins one, git fetch origin {0}:{0} brings that of a server",
        branch_));
  }
  std::string name = (std::filesystem::temp_directory_path() / "loopbench-history-XXXXXX").string();
  if (::mkdtemp(name.data()) == nullptr) FailOn("make", name);
  folder_ = std::filesystem::path(name) / "branch";
  if (!HasBranch(branch_)) {
    // an empty commit without parents: the history has nothing to do with the code's
    const std::string tree = Git({"hash-object", "-t", "tree", "-w", "/dev/null"});
    const std::string root = Git({"commit-tree", tree, "-m", "A history of measurements"});
    Git({"update-ref", "refs/heads/" + branch_, root});
  }
  std::vector<std::string> words = {"worktree", "add", "--quiet", folder_.string(), branch_};
  if (!writes) words.insert(words.begin() + 2, "--detach");
  Git(std::move(words));
}

HistoryBranch::~HistoryBranch() {
  RunProgram({"git", "worktree", "remove", "--force", folder_.string()});
  std::error_code ignored;
  std::filesystem::remove_all(folder_.parent_path(), ignored);
}

void HistoryBranch::Commit(const std::string& message) {
  Git({"-C", folder_.string(), "add", "--all"});
  if (Git({"-C", folder_.string(), "status", "--porcelain"}).empty()) return;
  // hooks are made for the code, which this branch has nothing of
  Git({"-C", folder_.string(), "commit", "--quiet", "--no-verify", "-m", message});
}

CheckedOut FindCommit(const std::string& commit) {
  // %cI has the committer's time zone: UTC dates can be sorted as texts
  const ProgramResult result = RunProgram({"env", "TZ=UTC", "git", "show", "-s", "--format=%H %cd",
                                           "--date=format-local:%Y-%m-%dT%H:%M:%SZ", commit});
  const std::size_t space = result.output.find(' ');
  if (result.Failure("git") != "" || space == std::string::npos) return {};
  return {result.output.substr(0, space), result.output.substr(space + 1, 20)};
}

}  // namespace loopbench::harness
