#include "harness/history/git.h"

#include <fmt/format.h>

#include <sstream>
#include <stdexcept>
#include <utility>

#include "harness/text/config_error.h"

namespace loopbench::harness {
namespace {

/// What says which repository, index and work tree a git command is about: `git rev-parse
/// --local-env-vars`, without settings (GIT_CONFIG_*), which may hold who commits.
constexpr const char* kLocal[] = {"GIT_ALTERNATE_OBJECT_DIRECTORIES",
                                  "GIT_OBJECT_DIRECTORY",
                                  "GIT_DIR",
                                  "GIT_WORK_TREE",
                                  "GIT_IMPLICIT_WORK_TREE",
                                  "GIT_GRAFT_FILE",
                                  "GIT_INDEX_FILE",
                                  "GIT_NO_REPLACE_OBJECTS",
                                  "GIT_REPLACE_REF_BASE",
                                  "GIT_PREFIX",
                                  "GIT_INTERNAL_SUPER_PREFIX",
                                  "GIT_SHALLOW_FILE",
                                  "GIT_COMMON_DIR"};

/// Hooks and settings that are made for the code, and how long git waits for another git.
constexpr const char* kSettings[] = {
    "core.hooksPath=/dev/null",      "core.attributesFile=/dev/null", "core.autocrlf=false",
    "core.sparseCheckout=false",     "core.fsmonitor=false",          "core.splitIndex=false",
    "core.filesRefLockTimeout=10000"};

std::string WithoutLineEnd(std::string text) {
  while (!text.empty() && text.back() == '\n') text.pop_back();
  return text;
}

/// As it is called, in the user's environment.
ProgramResult PlainGit(std::vector<std::string> words) {
  words.insert(words.begin(), "git");
  return RunProgram(std::move(words));
}

/// `who`: AUTHOR or COMMITTER.
std::vector<std::string> Nobody(const std::string& who) {
  return {"GIT_" + who + "_NAME=loopbench", "GIT_" + who + "_EMAIL=loopbench@localhost"};
}

}  // namespace

GitRepository::GitRepository() {
  const ProgramResult found = PlainGit({"rev-parse", "--path-format=absolute", "--git-common-dir"});
  if (const std::string failure = found.Failure("git"); !failure.empty()) {
    throw ConfigError("found no git repository here: " + WithoutLineEnd(failure));
  }
  folder_ = WithoutLineEnd(found.output);
}

ProgramResult GitRepository::Try(const std::vector<std::string>& words,
                                 const std::vector<std::string>& variables) const {
  std::vector<std::string> all = {"env"};
  for (const char* name : kLocal) all.insert(all.end(), {"-u", name});
  all.insert(all.end(), variables.begin(), variables.end());
  all.insert(all.end(), {"git", "--git-dir=" + folder_});
  for (const char* setting : kSettings) all.insert(all.end(), {"-c", setting});
  all.insert(all.end(), words.begin(), words.end());
  return RunProgram(std::move(all));
}

std::string GitRepository::Get(const std::vector<std::string>& words,
                               const std::vector<std::string>& variables) const {
  const ProgramResult result = Try(words, variables);
  if (const std::string failure = result.Failure("git"); !failure.empty()) {
    throw std::runtime_error(WithoutLineEnd(failure));
  }
  return WithoutLineEnd(result.output);
}

std::optional<std::string> GitRepository::BranchAt(const std::string& branch) const {
  const ProgramResult found = Try({"show-ref", "--verify", "--hash", "refs/heads/" + branch});
  if (found.status != 0 || found.error != 0) return std::nullopt;
  return WithoutLineEnd(found.output);
}

std::string GitRepository::CheckedOutIn(const std::string& branch) const {
  Try({"worktree", "prune"});  // those whose folder is gone
  std::istringstream lines(Get({"worktree", "list", "--porcelain"}));
  std::string folder;
  for (std::string line; std::getline(lines, line);) {
    if (line.starts_with("worktree ")) folder = line.substr(9);
    if (line == "branch refs/heads/" + branch) return folder;
  }
  return "";
}

std::string GitRepository::Commit(const std::string& folder, const std::string& index,
                                  const std::string& parent, const std::string& message) const {
  std::vector<std::string> variables = {"GIT_INDEX_FILE=" + index};
  Get({"-C", folder, "--work-tree=" + folder, "add", "--all", "--force"}, variables);
  const std::string tree = Get({"write-tree"}, variables);
  if (!parent.empty() && Get({"rev-parse", parent + "^{tree}"}) == tree) return parent;
  for (const char* who : {"AUTHOR", "COMMITTER"}) {
    if (Try({"var", fmt::format("GIT_{}_IDENT", who)}).status == 0) continue;
    for (const std::string& variable : Nobody(who)) variables.push_back(variable);
  }
  std::vector<std::string> words = {"commit-tree", "--no-gpg-sign", tree, "-m", message};
  if (!parent.empty()) words.insert(words.end(), {"-p", parent});
  return Get(words, variables);
}

CheckedOut FindCommit(const std::string& commit) {
  // in the user's environment: HEAD is that of the work tree that a hook runs in
  const auto parse = [](const std::string& name) {
    const ProgramResult found = PlainGit({"rev-parse", "--verify", "--end-of-options", name});
    return found.Failure("git").empty() ? WithoutLineEnd(found.output) : "";
  };
  const std::string object = parse(commit);
  const std::string hash = object.empty() ? "" : parse(object + "^{commit}");  // of a tag
  if (hash.empty()) return {};
  // %cd of --date=format-local: UTC dates can be sorted as texts
  const ProgramResult date =
      RunProgram({"env", "TZ=UTC", "git", "show", "-s", "--format=%cd",
                  "--date=format-local:%Y-%m-%dT%H:%M:%SZ", "--no-show-signature", hash});
  if (!date.Failure("git").empty()) return {};
  return {hash, WithoutLineEnd(date.output)};
}

}  // namespace loopbench::harness
