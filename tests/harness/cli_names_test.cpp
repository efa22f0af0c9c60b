// Names in files stay names: of files within the folder asked for, and of nothing on a terminal.
#include <unistd.h>

#include "tests/harness/cli_fixture.h"

namespace loopbench::harness::cli_names_test {

constexpr const char* kRun = "run tiny.json --out out ";

class Names : public CommandLineTest {
 protected:
  // All files under the folder of the test, by their paths.
  std::vector<std::string> Files(const std::string& ending) const {
    std::vector<std::string> files;
    for (const auto& entry : fs::recursive_directory_iterator(folder_)) {
      const std::string path = entry.path().lexically_relative(folder_).string();
      if (path.ends_with(ending)) files.push_back(path);
    }
    return files;
  }
};

TEST_F(Names, OfExperimentsDoNotLeaveTheFolderOfRuns) {
  fs::create_directories(folder_ / "deep/er");
  for (const std::string name : {"../../../escaped", "/tmp/loopbench-absolute", ".."}) {
    Expect("run ../../tiny.json --filter formulation=odca --set /name=" + name, 0,
           {"results in results/runs/"}, "cd deep/er &&");
  }
  const std::vector<std::string> stores = Files("results.jsonl");
  EXPECT_EQ(stores.size(), 3u);
  for (const std::string& store : stores) {
    EXPECT_TRUE(store.starts_with("deep/er/results/runs/")) << store;
  }
  EXPECT_FALSE(fs::exists("/tmp/loopbench-absolute"));
}

TEST_F(Names, OfMechanismsDoNotLeaveTheFolderOfFigures) {
  Expect(std::string(kRun) + "--set /problems/0/name=a/../../../outside", 0);
  Expect("plot out --out a/b/figures", 0, {"wrote 2 figures"});
  const std::vector<std::string> figures = Files(".svg");
  EXPECT_EQ(figures.size(), 2u);
  for (const std::string& figure : figures) EXPECT_TRUE(figure.starts_with("a/b/figures/"));
  // keys of records are names, too
  Expect("run tiny.json --out keys --set '/problems/0/mechanism/joints/3/name=../../x'", 0);
  Expect("plot keys --out a/b/free --x series.t --y series.angle.../../x", 0,
         {"wrote a/b/free/series.angle."});
  for (const std::string& figure : Files(".svg")) EXPECT_TRUE(figure.starts_with("a/b/")) << figure;
}

TEST_F(Names, WithAnythingInThemAreOnlyShown) {
  EditMechanism("\"name\": \"four-bar\"",
                R"("name": "\u001b]0;t\u0007\u001b[31mred\u0000nul\n<img src=x>''=1|a")");
  Write("tiny.json",
        Replaced(kTinyExperiment, "tiny", R"(\u001b[2J'' `touch pwned` $(touch pwned))"));
  for (const std::string call :
       {"list tiny.json", "check tiny.json four-bar.json", "explain tiny.json",
        "explain four-bar.json", "estimate tiny.json", "run tiny.json --out out", "table out",
        "table out --format csv", "table out --format markdown", "table out --format latex",
        "table out --format json", "plot out --out figures", "run tiny.json",
        "table out --where mechanism=none", "run tiny.json --out copy", "compare out copy",
        "export-metrics out --format bmf"}) {
    const Ending ending = Call(call);
    EXPECT_EQ(ending.code, call.find("none") != std::string::npos ? 2 : 0) << call << ending.text;
    const auto acts = [](char c) { return (c >= 0 && c < ' ' && c != '\n') || c == 0x7f; };
    EXPECT_TRUE(std::ranges::none_of(ending.text, acts)) << call << "\n" << ending.text;
    EXPECT_EQ(ending.text.find("\n<img"), std::string::npos) << call << "\n" << ending.text;
  }
  ExpectNone(ReadFile(folder_ / "out/drift.md"), {"<img"});
  EXPECT_TRUE(Files("pwned").empty());
  EXPECT_EQ(Files(".svg").size(), 2u);
}

#ifdef LOOPBENCH_BENCH_BINARY
TEST_F(Names, OfBenchmarksAreOnlyShown) {
  EditMechanism("\"name\": \"four-bar\"", R"("name": "a\u001b[31mb\u0000c")");
  Write("bench.json", R"({"name": "names", "groups": [{"mechanisms": ["four-bar.json"],
    "measure": "rhs", "methods": [{"formulation": "odca", "enforcement": "acceleration"}]}]})");
  const std::string text = Call("list tiny.json; '" LOOPBENCH_BENCH_BINARY
                                "' --families bench.json --benchmark_list_tests")
                               .text;
  ExpectWords(text, {"a\\x1b[31mb\\x00c/odca"});
  EXPECT_EQ(text.find('\x1b'), std::string::npos) << text;
}
#endif

TEST_F(Names, OfTheTemporaryFolderAndInTitlesAreNoCommands) {
  Expect(kRun, 0);
  fs::create_directories(folder_ / "t$(touch pwned)'");
  Expect("plot out --out figures", 0, {"wrote 2 figures"},
         "TMPDIR=\"$PWD/\"'t$(touch pwned)'\"'\"");
  EXPECT_TRUE(Files("pwned").empty());
  Expect("plot out --out t.svg --x drift_position_max --y energy_error_max --title \"'a''b'\"", 0,
         {"wrote t.svg"});
  ExpectWords(ReadFile(folder_ / "t.svg"), {"<text>'a''b'</text>"});
}

TEST_F(Names, OfTemporaryFilesAreNoneEvenWhenGnuplotKillsThePlot) {
  Expect(kRun, 0);
  Write("bin/gnuplot", "#!/bin/sh\nkill -9 $PPID\n");
  fs::permissions(folder_ / "bin/gnuplot", fs::perms::owner_all);
  fs::create_directories(folder_ / "tmp");
  EXPECT_NE(Call("plot out --out figures", "TMPDIR=\"$PWD/tmp\" PATH=\"$PWD/bin:$PATH\"").code, 0);
  EXPECT_TRUE(fs::is_empty(folder_ / "tmp"));
  EXPECT_TRUE(Files(".svg").empty());
}

TEST_F(Names, OfFoldersThatCannotBeMadeAreInTheMessage) {
  Expect(kRun, 0);
  fs::create_symlink("nowhere", folder_ / "dangling");  // cannot be made, even by root
  Expect("plot out --out dangling/figures", 2, {"cannot make folder 'dangling/figures'"});
  Expect("run tiny.json --out dangling/store", 2, {"cannot make folder 'dangling/store'"});
  if (::geteuid() == 0) return;  // may write everywhere
  fs::create_directories(folder_ / "kept");
  fs::permissions(folder_ / "kept", fs::perms::owner_read | fs::perms::owner_exec);
  Expect("table out --out kept/a/t.csv --format csv", 2,
         {"cannot make folder 'kept/a': Permission denied"});
}

}  // namespace loopbench::harness::cli_names_test
