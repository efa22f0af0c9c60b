// Histories on branches of a repository that people work in: hooks, ignore rules, others at once.
#include "tests/harness/cli_fixture.h"

namespace loopbench::harness::history_branch_test {

class HistoryBranchTest : public CommandLineTest {
 protected:
  void SetUp() override {
    CommandLineTest::SetUp();
    Expect("run tiny.json --no-timing --out first", 0);
    fs::create_directory(folder_ / "tmp");
    Do("git -c init.defaultBranch=main init --quiet . && "
       "git config user.name a && git config user.email a@b && "
       "git add tiny.json four-bar.json && git commit --quiet -m code");
  }
  /// A line of shell, with nothing of the machine's git and a folder of its own for what is
  /// temporary.
  Ending Shell(const std::string& command) const {
    return Call("--version > /dev/null && (" + command + ")",
                "export HOME='" + folder_.string() + "' TMPDIR='" + (folder_ / "tmp").string() +
                    "' GIT_CONFIG_NOSYSTEM=1 lb='" LOOPBENCH_BINARY "'; ");
  }
  void Do(const std::string& command) const { ExpectEnding(Shell(command), 0, {}); }
  std::string Text(const std::string& command) const { return Shell(command).text; }
  /// A git before the real one: a script that has its words.
  void StandIn(const std::string& script) const {
    fs::create_directory(folder_ / "bin");
    Write("bin/git", "#!/bin/sh\n" + script + "\nPATH=${PATH#*:}\nexec git \"$@\"\n");
    fs::permissions(folder_ / "bin/git", fs::perms::owner_all);
  }

  const std::string with_stand_in_ = "PATH=$PWD/bin:$PATH; ";
};

TEST_F(HistoryBranchTest, VariablesOfAHookLeadNowhereElse) {
  Do("export GIT_DIR=$PWD/.git GIT_INDEX_FILE=$PWD/.git/index GIT_WORK_TREE=$PWD && "
     "$lb history add first --branch h && $lb history add first --branch h --commit b "
     "--date 2026-01-01 && $lb history show --branch h && $lb history mark b good --branch h");
  EXPECT_EQ(Text("git log --format=%s main"), "code\n");
  EXPECT_EQ(Text("git status --porcelain --untracked-files=no"), "");
  EXPECT_EQ(Text("git ls-tree --name-only h"), "history.jsonl\nresults\n");
  EXPECT_EQ(Text("git ls-tree --name-only HEAD"), "four-bar.json\ntiny.json\n");
  // a repository without a work tree, by its variable alone
  Do("git clone --quiet --bare . elsewhere.git && cd tmp && "
     "GIT_DIR=$PWD/../elsewhere.git $lb history add ../first --branch other");
  Do("git -C elsewhere.git show other:history.jsonl");
  EXPECT_EQ(Text("git branch --list other"), "");
}

TEST_F(HistoryBranchTest, SeveralAddAtOnce) {
  // none is there yet: one begins the branch, and the others add to what it began
  Do("for i in 1 2 3 4; do ($lb history add first --branch h --commit c$i --date 2026-01-0$i "
     "|| touch failed) & done; wait; test ! -e failed");
  EXPECT_EQ(Text("git show h:history.jsonl | grep -c '\"kind\":\"commit\"'"), "4\n");
  EXPECT_EQ(Text("git ls-tree --name-only h:results | wc -l"), "4\n");
}

TEST_F(HistoryBranchTest, WhatSomebodyElseAddsMeanwhileStays) {
  Do("$lb history add first --branch h --commit a --date 2026-01-01");
  // another one is faster, once
  StandIn(
      "case \"$*\" in *update-ref*) mkdir once 2>/dev/null && PATH=${PATH#*:} && "
      "$lb history add first --branch h --commit b --date 2026-01-02 >&2;; esac");
  Do(with_stand_in_ + "$lb history mark a accepted --branch h");
  EXPECT_EQ(Text("git log --format=%s h"), "a is accepted\nMeasurements of b\nMeasurements of a\n");
  EXPECT_EQ(Text("git show h:history.jsonl | wc -l"), "3\n");
}

TEST_F(HistoryBranchTest, AKilledOneLeavesNothingLocked) {
  Do("$lb history add first --branch h --commit a --date 2026-01-01");
  StandIn("case \"$*\" in *update-ref*|*commit*) kill -9 $PPID; sleep 0.1;; esac");
  EXPECT_NE(Shell(with_stand_in_ + "$lb history add first --branch h --commit b "
                                   "--date 2026-01-02 2>&1")
                .code,
            0);
  Do("$lb history add first --branch h && $lb history show --branch h");
  EXPECT_EQ(Text("git worktree list | wc -l"), "1\n");
}

TEST_F(HistoryBranchTest, SettingsOfTheUserTakeNothingAway) {
  Write("ignored", "results/\n*.jsonl\n");
  Do("git config core.excludesFile $PWD/ignored && git config commit.gpgsign true && "
     "git config gpg.program false && git config --unset user.name && "
     "git config --unset user.email && git config user.useConfigOnly true && "
     "git config core.autocrlf true && git sparse-checkout set nothing && "
     "printf '#!/bin/sh\\nexit 1\\n' > .git/hooks/pre-commit && "
     "cp .git/hooks/pre-commit .git/hooks/post-checkout && "
     "cp .git/hooks/pre-commit .git/hooks/reference-transaction && chmod +x .git/hooks/*");
  Do("$lb history add first --branch h");
  Do("$lb history add first --branch h --commit b --date 2030-01-01 && "
     "$lb history show --branch h");
  EXPECT_EQ(Text("git ls-tree --name-only h:results | wc -l"), "2\n");
  EXPECT_EQ(Text("git log -1 --format=%an h"), "loopbench\n");
  EXPECT_EQ(Text("git show h:history.jsonl | tr -dc '\\r' | wc -c"), "0\n");
}

// Line ends and filters of a repository are for its code: what is stored is what was measured.
TEST_F(HistoryBranchTest, BytesAreThoseThatWereWritten) {
  Do("$lb history add first --branch h --commit a --date 2026-01-01 && "
     "$lb history add first --store folder --commit a --date 2026-01-01 && "
     "printf '*.jsonl filter=loud text eol=crlf\\n' > .git/info/attributes && "
     "git config filter.loud.clean 'tr a-z A-Z' && git config filter.loud.smudge 'tr a-z A-Z'");
  Do("$lb history add first --branch h --commit b --date 2026-01-02 && "
     "$lb history add first --store folder --commit b --date 2026-01-02 && "
     "$lb history show --branch h");
  Do("cd folder && for file in history.jsonl results/*; do "
     "git cat-file blob h:$file | cmp - $file || exit 1; done");
}

// What somebody put beside the history stays as it is: links, and names that git quotes.
TEST_F(HistoryBranchTest, OtherFilesOfTheBranchStay) {
  Do("$lb history add first --branch h --commit a --date 2026-01-01 && "
     "git worktree add --quiet --detach beside h && cd beside && ln -s nowhere link && "
     "echo 1 > '\"quoted' && echo 2 > \"$(printf 'two\\nlines')\" && git add --all && "
     "git commit --quiet -m more && git branch -f h HEAD");
  Do("$lb history add first --branch h --commit b --date 2026-01-02");
  EXPECT_EQ(Text("git diff --stat=200 h~1 h -- . ':!history.jsonl' ':!results'"), "");
  EXPECT_EQ(Text("git ls-tree -z h | tr -dc '\\0' | wc -c"), "5\n");
}

TEST_F(HistoryBranchTest, ABranchOfCodeIsNoHistory) {
  Do("git branch code && git branch empty $(git commit-tree -m x $(git mktree < /dev/null))");
  for (const char* command : {"history add first", "history show", "history mark a good",
                              "compare first", "history report"}) {
    ExpectEnding(Shell("$lb " + std::string(command) + " --branch code"), 2,
                 {"\"code\"", "no history.jsonl"});
  }
  EXPECT_EQ(Text("git log --format=%s code"), "code\n");
  Do("$lb history add first --branch empty");
  // files of a work tree would lag behind
  Do("git worktree add --quiet beside empty");
  ExpectEnding(Shell("$lb history add first --branch empty --commit b --date 2026-01-01"), 2,
               {"\"empty\" checked out in", "beside"});
  Do("$lb history show --branch empty");
  ExpectEnding(Shell("$lb history add first --branch 'a b'"), 2, {"\"a b\"", "name of a branch"});
  ExpectEnding(Shell("$lb history show --branch 'empty^'"), 2, {"\"empty^\""});
  // names that `git branch` rejects, and names that mean another branch
  Do("git checkout --quiet -b there && git checkout --quiet -");
  for (const char* name :
       {"-x", "HEAD", "@", "@{-1}", "refs/heads/a", "a..b", "a.lock", "a/", "/a", ".a", "a\nb"}) {
    ExpectEnding(Shell("$lb history add first '--branch=" + std::string(name) + "'"), 2,
                 {"expected the name of a branch"});
  }
  EXPECT_EQ(Text("git for-each-ref --format='%(refname:short)' | sort | tr '\n' ' '"),
            "code empty main there ");
}

TEST_F(HistoryBranchTest, NothingBeginsBeforeSomethingIsAdded) {
  ExpectEnding(Shell("$lb history mark a good --branch h"), 2, {"found no branch \"h\""});
  ExpectEnding(Shell("$lb history add first --branch h --date 2026-02-30"), 2, {"2026-02-30"});
  EXPECT_EQ(Text("git branch --list h"), "");
  Do("$lb history add first --branch h");
  const Ending twice = Shell("$lb history add first --branch h");
  ExpectEnding(twice, 2, {"h: found commit"});
  ExpectNone(twice.text, {"tmp"});
  ExpectEnding(Shell("$lb history mark nobody good --branch h"), 2, {"h: found 0 commits"});
  EXPECT_EQ(Text("ls tmp"), "");
}

// A branch may come from anywhere: its lines name files of their own history and no others.
TEST_F(HistoryBranchTest, ResultsOutsideOfTheHistoryAreRefusedUnread) {
  Do("$lb history add first --store past --commit a --date 2026-01-01");
  Write("secret", "root:x:0\n");
  fs::create_symlink(folder_ / "secret", folder_ / "past/results/link.jsonl");
  const Record line = ReadRecords(folder_ / "past/history.jsonl").front();
  const std::vector<std::string> outside = {
      "../secret", "results/../../secret", (folder_ / "secret").string(), "results/link.jsonl", ".",
      "results/.."};
  for (const std::string& name : outside) {
    fs::remove(folder_ / "past/history.jsonl");
    Record changed = line;
    changed.Set("results", name);
    ResultStore(folder_ / "past/history.jsonl").Append(changed);
    for (const char* command : {"history show --store past", "compare first --history past"}) {
      const Ending refused = Shell("$lb " + std::string(command));
      ExpectEnding(refused, 2,
                   {"\"results\": found \"" + name + "\", expected a path within the history"});
      ExpectNone(refused.text, {"root:"});
    }
  }
  // a folder instead of a file is named
  fs::remove(folder_ / "past/history.jsonl");
  Record folder = line;
  folder.Set("results", std::string("results"));
  ResultStore(folder_ / "past/history.jsonl").Append(folder);
  ExpectEnding(Shell("$lb history show --store past"), 2, {"past/results'", "found a folder"});
}

TEST_F(HistoryBranchTest, AProgramOrFolderThatIsNotThereIsNamed) {
  ExpectEnding(Shell("TMPDIR=/nowhere $lb history add first --branch h"), 2,
               {"TMPDIR: found '/nowhere', expected a folder"});
  fs::create_directory(folder_ / "none");
  for (const char* place : {"--branch h", "--store past"}) {
    ExpectEnding(Shell("PATH=$PWD/none \"$lb\" history add first " + std::string(place)), 2,
                 {"'git' not found"});
  }
}

// Signals that a process can handle leave no temporary folder, and the next command removes the
// folders of a killed process.
TEST_F(HistoryBranchTest, SignalsLeaveNoTemporaryFolder) {
  for (const std::string signal : {"TERM", "HUP", "INT", "KILL"}) {
    // the signal comes while git works for it
    StandIn(
        "case \"$*\" in *hash-object*) ls \"$TMPDIR\" > ../seen || ls $TMPDIR > $TMPDIR/../seen; "
        "kill -" +
        signal + " $PPID; sleep 1;; esac");
    Shell(with_stand_in_ + "(trap - INT; $lb history add first --branch h --commit " + signal +
          " --date 2026-01-01); true");
    EXPECT_NE(Text("cat seen"), "") << signal;
    EXPECT_EQ(Text("ls tmp | wc -l"), signal == "KILL" ? "1\n" : "0\n") << signal;
    fs::remove(folder_ / "seen");
  }
  Do("$lb history add first --branch h --commit a --date 2026-01-01");
  EXPECT_EQ(Text("ls tmp"), "");
}

TEST_F(HistoryBranchTest, TornLinesAreSaidByTheNameOfTheBranch) {
  Do("$lb history add first --branch h --commit a --date 2026-01-01 && "
     "git worktree add --quiet --detach beside h && cd beside && printf '{\"kind\":\"com' >> "
     "history.jsonl && truncate -s -5 results/*.jsonl && git commit --quiet -a -m torn && "
     "git branch -f h HEAD");
  for (const char* command : {"history show", "compare first --allow-missing", "history report"}) {
    const Ending ending = Shell("$lb " + std::string(command) + " --branch h");
    ExpectWords(ending.text, {"warning: h:history.jsonl:2", "warning: h:results/a-"});
  }
  ExpectEnding(Shell("$lb history mark a good --branch h"), 0, {"warning: h:history.jsonl:2"});
}

TEST_F(HistoryBranchTest, ANameOfACommitIsNoOption) {
  Do("git tag -a -m tag v1.0");
  Do("$lb history add first --branch h --commit v1.0");
  EXPECT_EQ(Text("git show h:history.jsonl | grep -c \"$(git rev-parse HEAD)\""), "1\n");
  ExpectEnding(Shell("$lb history add first --branch h --commit=--output=tmp/x"), 2,
               {"no such commit"});
  EXPECT_FALSE(fs::exists(folder_ / "tmp/x"));
}

}  // namespace loopbench::harness::history_branch_test
