// History through the program: a folder or a branch, steps, pages, and as the base of a comparison.
#include "tests/harness/cli_fixture.h"

namespace loopbench::harness::cli_history_test {

class CommandLineHistory : public CommandLineTest {
 protected:
  void SetUp() override {
    CommandLineTest::SetUp();
    // nothing of the machine's git: neither name nor branch of its user
    Shell("git -c init.defaultBranch=main init --quiet .");
    Run("first");
  }
  Ending Shell(const std::string& command) const {
    return Call("--version",
                "export HOME='" + folder_.string() + "' GIT_CONFIG_NOSYSTEM=1; " + command + " &&");
  }
  void Run(const std::string& name, const std::string& more = "") const {
    Expect("run tiny.json --no-timing --out " + name + " " + more, 0);
  }
  void Commit(const std::string& message) const {
    const Ending ending = Shell(
        "git add tiny.json four-bar.json && git -c user.name=a -c user.email=a@b commit --quiet "
        "--allow-empty -m '" +
        message + "'");
    ASSERT_EQ(ending.code, 0) << ending.text;
  }
};

TEST_F(CommandLineHistory, OfAFolder) {
  Expect("history show --store past", 2, {"past/history.jsonl", "history add"});
  Expect("history add first --store past --commit a --date tomorrow", 2, {"tomorrow"});
  Expect("history add first --store past", 2, {"no such commit"});
  EXPECT_FALSE(fs::exists(folder_ / "past"));
  for (int day = 10; day < 20; ++day) {
    if (day == 16) {
      fs::remove_all(folder_ / "first");
      Run("first", "--set /problems/0/mechanism/bodies/0/mass=1.5");
    }
    const std::string name = std::to_string(day);
    Expect("history add first --store past --commit c" + name + " --date 2026-01-" + name, 0,
           {"added 2 records of commit c" + name});
  }
  Expect("history add first --store past --commit c19 --date 2026-01-19", 2,
         {"found commit c19", "--replace"});
  const Ending shown = Call("history show --store past --measure drift_position_max --json");
  EXPECT_EQ(shown.code, 0);
  // one for each of the two cases, and none elsewhere
  EXPECT_EQ(CountOf(shown.text, "\"confidence\""), 2u) << shown.text;
  Expect("history show --store past --measure drift_position", 0, {"c16", "c19"});
  Expect("history show --store past --measure nothing", 2, {"\"nothing\""});
  Expect("history report --store past --title '<b>'", 0, {"past/history.html"});
  ExpectWords(ReadFile(folder_ / "past/history.html"), {"&lt;b&gt;"});
  Expect("history show", 2, {"--store"});
  for (const fs::directory_entry& file : fs::directory_iterator(folder_ / "past/results")) {
    fs::resize_file(file.path(), 0);
  }
  Expect("history report --store past", 2, {"past/results/", "found no record"});
}

TEST_F(CommandLineHistory, OfABranchAndAsABase) {
  Commit("one");
  Expect("history add first --branch measured", 0, {"added 2 records"});
  EXPECT_EQ(Shell("test -z \"$(git status --porcelain tiny.json four-bar.json)\"").code, 0);
  EXPECT_EQ(Shell("git show measured:history.jsonl").code, 0);
  Expect("compare --branch measured first", 0, {"NO CHANGE"});
  EditMechanism("\"mass\": 1.0", "\"mass\": 1.1");
  Commit("heavier");
  Run("second");
  // another mechanism is no worse one: it cannot be compared
  Expect("compare --branch measured second --markdown s.md --junit s.xml", 2, {"INCONCLUSIVE"});
  ExpectWords(ReadFile(folder_ / "s.xml"), {"<failure"});
  ExpectWords(ReadFile(folder_ / "s.md"), {"ran another mechanism"});
  Expect("history add second --branch measured", 0);
  Expect("compare --branch measured second", 0, {"NO CHANGE"});
  Expect("history mark HEAD bad --branch measured", 2, {"found 0 commits"});
  EXPECT_EQ(Shell("git log --format=%s measured | wc -l | grep -qx 2").code, 0);
  // no work tree of the branch is left
  EXPECT_EQ(Shell("git worktree list | wc -l | grep -qx 1").code, 0);
}

TEST_F(CommandLineHistory, CompareNeedsOneBaseWithACommit) {
  Write("past/history.jsonl", "");
  Expect("compare first --history past", 2, {"past: found no commit"});
  Expect("history add first --store past --commit a --date 2026-01-01", 0);
  Expect("history mark a bad --store past", 0);
  Expect("compare first --history past", 2, {"past: found every commit marked bad"});
  Expect("compare first", 2, {"--history"});
  Expect("compare first first --history past", 2, {"NEW alone"});
  Expect("compare first --branch nothing-here", 2,
         {"found no branch \"nothing-here\"", "history add begins one"});
}

}  // namespace loopbench::harness::cli_history_test
