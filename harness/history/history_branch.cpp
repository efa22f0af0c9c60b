#include "harness/history/history_branch.h"

#include <fmt/format.h>

#include <stdexcept>
#include <utility>

#include "harness/text/config_error.h"

namespace loopbench::harness {
namespace {

void RequireBranchName(const GitRepository& git, const std::string& branch) {
  // "--branch" refuses "-x" and "HEAD" as `git branch` does, and takes "@{-1}" for another name
  const ProgramResult checked = git.Try({"check-ref-format", "--branch", branch});
  if (checked.status == 0 && checked.output == branch + "\n") return;
  throw ConfigError(fmt::format("--branch: found \"{}\", expected the name of a branch", branch));
}

void RequireHistory(const GitRepository& git, const std::string& branch, const std::string& at) {
  const std::string files = "\n" + git.Get({"ls-tree", "--name-only", at}) + "\n";
  if (files == "\n\n" || files.find("\nhistory.jsonl\n") != std::string::npos) return;
  throw ConfigError(
      fmt::format("--branch: found \"{}\" with files but no history.jsonl, expected a branch of "
                  "its own for a history; loopbench history add begins one",
                  branch));
}

}  // namespace

HistoryBranch::HistoryBranch(std::string branch, bool may_begin)
    : branch_(std::move(branch)),
      temporary_("loopbench-history"),
      folder_(temporary_.path() / "branch") {
  RequireBranchName(git_, branch_);
  at_ = git_.BranchAt(branch_).value_or("");
  if (at_.empty() && !may_begin) {
    throw ConfigError(fmt::format(
        "found no branch \"{0}\" in a git repository here, expected a history; loopbench history "
        "add begins one, git fetch origin {0}:{0} brings that of a server",
        branch_));
  }
  std::filesystem::create_directory(folder_);
  if (at_.empty()) return;
  RequireHistory(git_, branch_, at_);
  git_.Export(at_, folder_, Index());
}

std::string HistoryBranch::Named(std::string message) const {
  const std::string folder = folder_.string();
  for (std::size_t at = 0; (at = message.find(folder, at)) != std::string::npos;) {
    const bool is_within = message.compare(at + folder.size(), 1, "/") == 0;
    const std::string name = branch_ + (is_within ? ":" : "");
    message.replace(at, folder.size() + (is_within ? 1 : 0), name);
    at += name.size();
  }
  return message;
}

bool HistoryBranch::Commit(const std::string& message) {
  const std::string commit = git_.Commit(folder_, Index(), at_, message);
  if (commit == at_) return true;
  if (const std::string where = git_.CheckedOutIn(branch_); !where.empty()) {
    throw ConfigError(fmt::format(
        "--branch: found \"{}\" checked out in {}, expected a branch that is in no work tree",
        branch_, where));
  }
  // git refuses when the branch is not at at_ any more; "" is a branch that is not there yet
  const ProgramResult moved =
      git_.Try({"update-ref", "-m", message, "refs/heads/" + branch_, commit,
                at_.empty() ? std::string(commit.size(), '0') : at_});
  if (moved.Failure("git").empty()) return true;
  if (git_.BranchAt(branch_).value_or("") != at_) return false;
  throw std::runtime_error(moved.Failure("git"));
}

}  // namespace loopbench::harness
