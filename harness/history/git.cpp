#include <fmt/format.h>

#include <fstream>
#include <sstream>
#include <stdexcept>
#include <utility>

#include "harness/base/text.h"
#include "harness/history/history.h"

namespace loopbench::harness {
namespace {

/// Variables that select repository, index and work tree of git: `git rev-parse --local-env-vars`,
/// without settings (GIT_CONFIG_*), which may contain the committer.
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

/// Settings that disable hooks and monitors of the code's repository, and the lock timeout of git.
constexpr const char* kSettings[] = {"core.hooksPath=/dev/null", "core.fsmonitor=false",
                                     "core.splitIndex=false", "core.filesRefLockTimeout=10000"};

std::string WithoutLineEnd(std::string text) {
  while (!text.empty() && text.back() == '\n') text.pop_back();
  return text;
}

/// Runs git in the user's environment.
ProgramResult PlainGit(std::vector<std::string> words) {
  words.insert(words.begin(), "git");
  return RunProgram(std::move(words));
}

/// Returns the words for a folder as work tree, in place of the repository's own.
std::vector<std::string> At(const std::filesystem::path& folder, std::vector<std::string> words) {
  words.insert(words.begin(), {"-C", folder.string(), "--work-tree=" + folder.string()});
  return words;
}

/// Returns variables of a default identity. `who`: AUTHOR or COMMITTER.
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
                                 const std::vector<std::string>& variables,
                                 const std::string& input) const {
  std::vector<std::string> all = {"env"};
  for (const char* name : kLocal) all.insert(all.end(), {"-u", name});
  all.insert(all.end(), variables.begin(), variables.end());
  all.insert(all.end(), {"git", "--git-dir=" + folder_});
  for (const char* setting : kSettings) all.insert(all.end(), {"-c", setting});
  all.insert(all.end(), words.begin(), words.end());
  return RunProgram(std::move(all), input);
}

std::string GitRepository::Get(const std::vector<std::string>& words,
                               const std::vector<std::string>& variables,
                               const std::string& input) const {
  const ProgramResult result = Try(words, variables, input);
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
  Try({"worktree", "prune"});  // removes work trees whose folder is gone
  std::istringstream lines(Get({"worktree", "list", "--porcelain"}));
  std::string folder;
  for (std::string line; std::getline(lines, line);) {
    if (line.starts_with("worktree ")) folder = line.substr(9);
    if (line == "branch refs/heads/" + branch) return folder;
  }
  return "";
}

void GitRepository::Export(const std::string& commit, const std::filesystem::path& folder,
                           const std::string& index) const {
  // an index rejects paths that lead out of the folder
  Get({"read-tree", commit}, {"GIT_INDEX_FILE=" + index});
  const std::string listed =
      Get(At(folder, {"ls-files", "--stage", "-z"}), {"GIT_INDEX_FILE=" + index});
  std::vector<std::string> paths;
  std::string objects;
  std::istringstream files(listed);  // "MODE OBJECT STAGE\tPATH\0"
  for (std::string file; std::getline(files, file, '\0');) {
    const std::size_t path = file.find('\t') + 1, object = file.find(' ') + 1;
    // histories have no paths with a line end, and Commit() could not pass them
    if (!file.starts_with("100") || file.find('\n') != std::string::npos) continue;
    paths.push_back(file.substr(path));
    objects += file.substr(object, file.find(' ', object) - object) + '\n';
  }
  const ProgramResult read = Try({"cat-file", "--batch"}, {}, objects);
  if (const std::string failure = read.Failure("git"); !failure.empty()) {
    throw std::runtime_error(WithoutLineEnd(failure));
  }
  std::size_t at = 0;  // "OBJECT blob SIZE\n", the bytes, "\n"
  for (const std::string& path : paths) {
    const std::size_t end = read.output.find('\n', at);
    const std::string head = read.output.substr(at, end - at);
    if (head.find(" blob ") == std::string::npos) {
      throw std::runtime_error(fmt::format("git has no bytes of {}: {}", path, head));
    }
    const std::size_t size = std::stoull(head.substr(head.rfind(' ') + 1));
    MakeFolderOf(folder / path);
    std::ofstream out(folder / path, std::ios::binary);
    out << std::string_view(read.output).substr(end + 1, size);
    if (!out.flush()) FailOn("write", folder / path);
    at = end + 1 + size + 1;
  }
}

std::string GitRepository::Commit(const std::filesystem::path& folder, const std::string& index,
                                  const std::string& parent, const std::string& message) const {
  std::vector<std::string> variables = {"GIT_INDEX_FILE=" + index}, paths;
  std::string names;
  for (const auto& file : std::filesystem::recursive_directory_iterator(folder)) {
    if (!file.is_regular_file()) continue;
    paths.push_back(file.path().lexically_relative(folder).string());
    names += "./" + paths.back() + '\n';  // "./": git would unquote an initial quote
  }
  std::istringstream objects(
      Get(At(folder, {"hash-object", "-w", "--no-filters", "--stdin-paths"}), {}, names));
  std::string entries;
  for (const std::string& path : paths) {
    std::string object;
    objects >> object;
    entries += fmt::format("100644 {}\t{}", object, path) + '\0';
  }
  Get(At(folder, {"update-index", "-z", "--index-info"}), variables, entries);
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
  // in the user's environment, because HEAD is the one of the work tree of a hook
  const auto parse = [](const std::string& name) {
    const ProgramResult found = PlainGit({"rev-parse", "--verify", "--end-of-options", name});
    if (found.error != 0) throw ConfigError(found.Failure("git") + ", which finds commits");
    return found.Failure("git").empty() ? WithoutLineEnd(found.output) : "";
  };
  const std::string object = parse(commit);
  const std::string hash = object.empty() ? "" : parse(object + "^{commit}");  // dereferences tags
  if (hash.empty()) return {};
  // %cd with --date=format-local: UTC dates sort as text
  const ProgramResult date =
      RunProgram({"env", "TZ=UTC", "git", "show", "-s", "--format=%cd",
                  "--date=format-local:%Y-%m-%dT%H:%M:%SZ", "--no-show-signature", hash});
  if (!date.Failure("git").empty()) return {};
  return {hash, WithoutLineEnd(date.output)};
}
namespace {

void RequireBranchName(const GitRepository& git, const std::string& branch) {
  // "--branch" rejects "-x" and "HEAD" as `git branch` does, and resolves "@{-1}"
  const ProgramResult checked = git.Try({"check-ref-format", "--branch", branch});
  const bool is_reference = branch == "@" || branch.starts_with("refs/");
  if (checked.status == 0 && checked.output == branch + "\n" && !is_reference) return;
  throw ConfigError(fmt::format("--branch: found \"{}\", expected the name of a branch{}", branch,
                                is_reference ? ", such as \"history\"" : ""));
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
  // git refuses if the branch is no longer at at_; "" means a new branch
  const ProgramResult moved =
      git_.Try({"update-ref", "-m", message, "refs/heads/" + branch_, commit,
                at_.empty() ? std::string(commit.size(), '0') : at_});
  if (moved.Failure("git").empty()) return true;
  if (git_.BranchAt(branch_).value_or("") != at_) return false;
  throw std::runtime_error(moved.Failure("git"));
}
namespace {

bool IsBranch(const HistoryPlace& place) {
  if (place.store.empty() == place.branch.empty()) {
    throw ConfigError("history: expected one of --store DIR and --branch NAME");
  }
  return !place.branch.empty();
}

OpenHistory OpenFolder(const HistoryPlace& place) {
  return {place.store, [](std::string message) { return message; }};
}

template <typename Work>
auto OnBranch(const HistoryBranch& branch, const Work& work) {
  try {
    return work(OpenHistory{branch.folder(), [&branch](std::string message) {
                              return branch.Named(std::move(message));
                            }});
  } catch (const ConfigError& error) {
    throw ConfigError(branch.Named(error.what()));
  } catch (const std::runtime_error& error) {
    throw std::runtime_error(branch.Named(error.what()));
  }
}

}  // namespace

void ReadPlace(const HistoryPlace& place, const std::function<void(const OpenHistory&)>& read) {
  if (IsBranch(place)) {
    OnBranch(HistoryBranch(place.branch), read);
  } else {
    read(OpenFolder(place));
  }
}

void ChangePlace(const HistoryPlace& place, bool may_begin,
                 const std::function<std::string(const OpenHistory&)>& change) {
  if (!IsBranch(place)) {
    change(OpenFolder(place));
    return;
  }
  for (bool is_kept = false; !is_kept;) {
    HistoryBranch branch(place.branch, may_begin);
    is_kept = branch.Commit(OnBranch(branch, change));
  }
}

}  // namespace loopbench::harness
