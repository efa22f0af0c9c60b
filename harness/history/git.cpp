#include <fstream>
#include <sstream>

#include "harness/base/text.h"
#include "harness/history/history.h"

namespace loopbench::harness {
namespace {

/// Variables that select repository, index and work tree of git: `git rev-parse --local-env-vars`,
/// without settings (GIT_CONFIG_*), which may contain the committer.
constexpr const char* kLocal =
    "GIT_ALTERNATE_OBJECT_DIRECTORIES GIT_OBJECT_DIRECTORY GIT_DIR GIT_WORK_TREE "
    "GIT_IMPLICIT_WORK_TREE GIT_GRAFT_FILE GIT_INDEX_FILE GIT_NO_REPLACE_OBJECTS "
    "GIT_REPLACE_REF_BASE GIT_PREFIX GIT_INTERNAL_SUPER_PREFIX GIT_SHALLOW_FILE GIT_COMMON_DIR";

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

/// Returns the folder .git, common to all work trees.
std::string RepositoryHere() {
  const ProgramResult found = PlainGit({"rev-parse", "--path-format=absolute", "--git-common-dir"});
  if (const std::string failure = found.Failure("git"); !failure.empty()) {
    throw ConfigError("found no git repository here: " + WithoutLineEnd(failure));
  }
  return WithoutLineEnd(found.output);
}

/// Throws std::runtime_error with the message of git if it failed.
const ProgramResult& Succeeded(const ProgramResult& result) {
  const std::string failure = result.Failure("git");
  if (!failure.empty()) throw std::runtime_error(WithoutLineEnd(failure));
  return result;
}

/// Files of a branch of the current repository, in a temporary folder. The repository changes only
/// in Commit(). Several processes may work at once.
///
/// Variables of a hook (GIT_DIR, GIT_INDEX_FILE, ...) only select the repository: the user's index
/// and work tree are never used. Hooks do not run. User settings cannot change file contents or the
/// set of files.
class HistoryBranch {
 public:
  HistoryBranch(std::string branch, bool may_begin)
      : repository_(RepositoryHere()),
        branch_(std::move(branch)),
        temporary_("loopbench-history"),
        folder_(temporary_.path() / "branch") {
    RequireBranchName();
    at_ = CommitOfBranch();
    if (at_.empty() && !may_begin) {
      throw ConfigError(fmt::format(
          "found no branch \"{0}\" in a git repository here, expected a history; loopbench history "
          "add begins one, git fetch origin {0}:{0} brings that of a server",
          branch_));
    }
    std::filesystem::create_directory(folder_);
    if (at_.empty()) return;
    RequireHistory();
    Export();
  }

  const std::filesystem::path& folder() const { return folder_; }

  /// Returns the message with the branch in place of the folder: "measured:history.jsonl".
  std::string Named(std::string message) const {
    const std::string folder = folder_.string();
    for (std::size_t at = 0; (at = message.find(folder, at)) != std::string::npos;) {
      const bool is_within = message.compare(at + folder.size(), 1, "/") == 0;
      const std::string name = branch_ + (is_within ? ":" : "");
      message.replace(at, folder.size() + (is_within ? 1 : 0), name);
      at += name.size();
    }
    return message;
  }

  /// Commits all changes to the branch, which may be new; does nothing without changes. Returns
  /// false if another process has changed it: repeat the changes in a new HistoryBranch.
  bool Commit(const std::string& message) {
    const std::string commit = NewCommit(message);
    if (commit == at_) return true;
    if (const std::string where = CheckedOutIn(); !where.empty()) {
      throw ConfigError(fmt::format(
          "--branch: found \"{}\" checked out in {}, expected a branch that is in no work tree",
          branch_, where));
    }
    // git refuses if the branch is no longer at at_; "" means a new branch
    const ProgramResult moved = Try({"update-ref", "-m", message, "refs/heads/" + branch_, commit,
                                     at_.empty() ? std::string(commit.size(), '0') : at_});
    if (moved.Failure("git").empty()) return true;
    if (CommitOfBranch() != at_) return false;
    throw std::runtime_error(moved.Failure("git"));
  }

 private:
  using Words = std::vector<std::string>;

  /// @param variables  "NAME=value", in addition to the environment
  /// @param input      standard input
  ProgramResult Try(const Words& words, const Words& variables = {},
                    const std::string& input = "") const {
    Words all = {"env"};
    std::istringstream names(kLocal);
    for (std::string name; names >> name;) all.insert(all.end(), {"-u", name});
    all.insert(all.end(), variables.begin(), variables.end());
    all.insert(all.end(), {"git", "--git-dir=" + repository_});
    for (const char* setting : kSettings) all.insert(all.end(), {"-c", setting});
    all.insert(all.end(), words.begin(), words.end());
    return RunProgram(std::move(all), input);
  }

  /// Returns the output without the line end, or throws.
  std::string Get(const Words& words, const Words& variables = {},
                  const std::string& input = "") const {
    return WithoutLineEnd(Succeeded(Try(words, variables, input)).output);
  }

  /// Git with the folder as work tree, in place of the repository's own.
  std::string GetAt(Words words, const Words& variables, const std::string& input = "") const {
    words.insert(words.begin(), {"-C", folder_.string(), "--work-tree=" + folder_.string()});
    return Get(words, variables, input);
  }

  Words Index() const { return {"GIT_INDEX_FILE=" + (temporary_.path() / "index").string()}; }

  /// Returns "" if there is no branch.
  std::string CommitOfBranch() const {
    const ProgramResult found = Try({"show-ref", "--verify", "--hash", "refs/heads/" + branch_});
    return found.status != 0 || found.error != 0 ? "" : WithoutLineEnd(found.output);
  }

  /// Returns the work tree in which the branch is checked out; "" if none.
  std::string CheckedOutIn() const {
    Try({"worktree", "prune"});  // removes work trees whose folder is gone
    std::istringstream lines(Get({"worktree", "list", "--porcelain"}));
    std::string folder;
    for (std::string line; std::getline(lines, line);) {
      if (line.starts_with("worktree ")) folder = line.substr(9);
      if (line == "branch refs/heads/" + branch_) return folder;
    }
    return "";
  }

  void RequireBranchName() const {
    // "--branch" rejects "-x" and "HEAD" as `git branch` does, and resolves "@{-1}"
    const ProgramResult checked = Try({"check-ref-format", "--branch", branch_});
    const bool is_reference = branch_ == "@" || branch_.starts_with("refs/");
    if (checked.status == 0 && checked.output == branch_ + "\n" && !is_reference) return;
    throw ConfigError(fmt::format("--branch: found \"{}\", expected the name of a branch{}",
                                  branch_, is_reference ? ", such as \"history\"" : ""));
  }

  void RequireHistory() const {
    const std::string files = "\n" + Get({"ls-tree", "--name-only", at_}) + "\n";
    if (files == "\n\n" || files.find("\nhistory.jsonl\n") != std::string::npos) return;
    throw ConfigError(
        fmt::format("--branch: found \"{}\" with files but no history.jsonl, expected a branch of "
                    "its own for a history; loopbench history add begins one",
                    branch_));
  }

  /// Writes the regular files of the commit into the folder, byte for byte: attributes, filters and
  /// line-end settings of the user have no effect. Other entries are not written.
  void Export() const {
    // an index rejects paths that lead out of the folder
    Get({"read-tree", at_}, Index());
    std::vector<std::string> paths;
    std::string objects;
    std::istringstream files(  // "MODE OBJECT STAGE\tPATH\0"
        GetAt({"ls-files", "--stage", "-z"}, Index()));
    for (std::string file; std::getline(files, file, '\0');) {
      const std::size_t path = file.find('\t') + 1, object = file.find(' ') + 1;
      // histories have no paths with a line end, and Commit() could not pass them
      if (!file.starts_with("100") || file.find('\n') != std::string::npos) continue;
      paths.push_back(file.substr(path));
      objects += file.substr(object, file.find(' ', object) - object) + '\n';
    }
    const ProgramResult read = Succeeded(Try({"cat-file", "--batch"}, {}, objects));
    std::size_t at = 0;  // "OBJECT blob SIZE\n", the bytes, "\n"
    for (const std::string& path : paths) {
      const std::size_t end = read.output.find('\n', at);
      const std::string head = read.output.substr(at, end - at);
      if (head.find(" blob ") == std::string::npos) {
        throw std::runtime_error(fmt::format("git has no bytes of {}: {}", path, head));
      }
      const std::size_t size = std::stoull(head.substr(head.rfind(' ') + 1));
      MakeFolderOf(folder_ / path);
      std::ofstream out(folder_ / path, std::ios::binary);
      out << std::string_view(read.output).substr(end + 1, size);
      if (!out.flush()) FailOn("write", folder_ / path);
      at = end + 1 + size + 1;
    }
  }

  /// Returns a new commit on top of at_ with its files and all of the folder, unchanged by ignore,
  /// conversion or signature settings; at_ if nothing changed.
  std::string NewCommit(const std::string& message) const {
    Words variables = Index(), paths;
    std::string names;
    for (const auto& file : std::filesystem::recursive_directory_iterator(folder_)) {
      if (!file.is_regular_file()) continue;
      paths.push_back(file.path().lexically_relative(folder_).string());
      names += "./" + paths.back() + '\n';  // "./": git would unquote an initial quote
    }
    std::istringstream objects(
        GetAt({"hash-object", "-w", "--no-filters", "--stdin-paths"}, {}, names));
    std::string entries;
    for (const std::string& path : paths) {
      std::string object;
      objects >> object;
      entries += fmt::format("100644 {}\t{}", object, path) + '\0';
    }
    GetAt({"update-index", "-z", "--index-info"}, variables, entries);
    const std::string tree = Get({"write-tree"}, variables);
    if (!at_.empty() && Get({"rev-parse", at_ + "^{tree}"}) == tree) return at_;
    for (const std::string who : {"AUTHOR", "COMMITTER"}) {
      if (Try({"var", "GIT_" + who + "_IDENT"}).status == 0) continue;
      variables.push_back("GIT_" + who + "_NAME=loopbench");
      variables.push_back("GIT_" + who + "_EMAIL=loopbench@localhost");
    }
    Words words = {"commit-tree", "--no-gpg-sign", tree, "-m", message};
    if (!at_.empty()) words.insert(words.end(), {"-p", at_});
    return Get(words, variables);
  }

  std::string repository_;
  std::string branch_, at_;  ///< at_: the commit that was read, "" for a new branch
  TemporaryFolder temporary_;
  std::filesystem::path folder_;
};

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

void ReadPlace(const HistoryPlace& place, const std::function<void(const OpenHistory&)>& read) {
  if (IsBranch(place)) {
    OnBranch(HistoryBranch(place.branch, /*may_begin=*/false), read);
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
