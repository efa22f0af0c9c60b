// The program as its users call it: exit codes, messages, and the files it leaves.
#include "tests/harness/cli_fixture.h"

namespace loopbench::harness::cli_test {

class BadInput : public CommandLineTest {
 protected:
  /// Run and check refuse the folder's files with the same words, and nothing is written.
  void ExpectRefused(const std::vector<std::string>& words) const {
    Expect("run tiny.json --out out", 2, words);
    Expect("check tiny.json", 2, words);
    EXPECT_FALSE(fs::exists(folder_ / "out"));
  }
};

TEST_F(BadInput, OfFilesNamesFilePointerAndCure) {
  struct Mistake {
    std::string from, to;
    std::vector<std::string> words;
  };
  for (const Mistake& one :
       std::vector<Mistake>{{"\"inertia\"",
                             "\"inertai\"",
                             {"/bodies/0/inertai: found unknown key", "did you mean \"inertia\""}},
                            {"\"mass\": 1.0",
                             "\"mass\": \"heavy\"",
                             {"/bodies/0/mass: found \"heavy\"", "expected a number > 0"}},
                            {"\"to\": {\"body\": \"bar1\"",
                             "\"to\": {\"body\": \"bra1\"",
                             {"/joints/0/to/body: found \"bra1\"", "did you mean \"bar1\""}},
                            {"\"mass\": 1.0, \"inertia\": 1.0",
                             "\"mass\": -1.0, \"inertia\": -2.0",
                             {"/bodies/0/mass: found -1", "expected a number > 0",
                              "/bodies/0/inertia: found -2"}}}) {
    SCOPED_TRACE(one.to);
    EditMechanism(one.from, one.to);
    ExpectRefused(one.words);
  }
  fs::rename(folder_ / "four-bar.json", folder_ / "four-bars.json");
  ExpectRefused(
      {"/problems/0/mechanism", "four-bar.json does not exist", "did you mean \"four-bars.json\""});
  Write("tiny.json", Replaced(kTinyExperiment, "{", R"({"tolerance": 1e-6,)"));
  ExpectRefused({"/tolerance: found unknown key", "did you mean \"tolerances\""});
}

TEST_F(BadInput, OfTheCommandLineIsNamed) {
  for (const std::string command : {"run", "list", "check"}) {
    Expect(command + " absent.json", 2, {"absent.json"});
  }
  Expect("", 2, {"expected a command"});
  Expect("run tiny.json --jobs 0", 2, {"--jobs"});
  Expect("run", 2, {"experiment"});
  for (const std::string filter : {"mechanism", "=four-bar", "mechanism="}) {
    Expect("run tiny.json --filter " + filter, 2, {"filter '" + filter + "'", "key=value"});
  }
  Expect("list tiny.json --filter mechanisms=four-bar", 2, {"mechanisms"});
  // a run of nothing would replace old results with an empty file
  Expect("run tiny.json --out out --filter mechanism=five-bar", 2, {"mechanism=five-bar"});
  EXPECT_FALSE(fs::exists(folder_ / "out/results.jsonl"));
  Expect("table nowhere", 2, {"nowhere"});
  Expect("plot nowhere --out figures", 2, {"nowhere"});
  Expect("check-claims nowhere --claims claims.json", 2, {"nowhere"});
}

TEST_F(CommandLineTest, UnreachableAssemblyIsARowAndNoError) {
  EditMechanism("\"C\": [1.5, 0.0]", "\"C\": [5.0, 0.0]");
  Expect("run tiny.json --out out", 0, {"bad start"});
  const std::vector<Record> records = ReadRecords(folder_ / "out");
  ASSERT_EQ(records.size(), 2u);
  EXPECT_EQ(records[0].Text("outcome"), "inconsistent-start");
  ExpectWords(records[0].Text("message"), {"\"OC\""});
}

TEST_F(CommandLineTest, HelpListAndCheckDescribeTheirSubjects) {
  Expect("--help", 0, {"Examples (from", "Exit status: 0 success"});
  Expect("run --help", 0, {"--filter"});
  Expect("--version", 0, {"loopbench 1.", "commit: ", "compiler: ", "SUNDIALS "});
  Expect("list tiny.json", 0,
         {"tiny: two cases", "four-bar", "odca", "lagrange", "2 cases and 0 timings"});
  Expect("list tiny.json --filter formulation=odca", 0, {"1 case and 0 timings"});
  Expect("check tiny.json four-bar.json", 0, {"2 cases", "3 bodies, 4 joints"});
  Expect("check claims.json", 0, {"claims.json: 1 claim"});
}

TEST_F(CommandLineTest, ResultsOfARunServeTablePlotAndVerdict) {
  Expect("run tiny.json --out out", 0, {"results in out"});
  const std::string csv = ReadFile(folder_ / "out/drift.csv");
  ExpectWords(csv, {"drift_position_max"});
  const std::string table = ReadFile(folder_ / "out/drift.md");
  ExpectWords(table, {"command: loopbench run tiny.json --out out"});
  EXPECT_EQ(ReadRecords(folder_ / "out").size(), 2u);

  Expect("table out", 0, {"four-bar", "odca", "lagrange"});
  Expect("table out --format csv --where formulation=odca", 0, {"mechanism", "odca"});
  Expect("table out --where formulation=reduction", 2, {"no drift records match"});
  Expect("table out --where kind=timing", 2, {"--kind timing"});
  Expect("table --help", 0, {"--group KEY "});
  Expect("check-claims out --claims claims.json --out verdicts.md", 0, {"reproduced"});
  ExpectWords(ReadFile(folder_ / "verdicts.md"), {"It is."});
  Expect("plot out --out figures", 0, {"figures to figures"});
  for (const auto& entry : fs::directory_iterator(folder_ / "figures")) {
    EXPECT_NE(ReadFile(entry.path()).find("<svg"), std::string::npos) << entry.path();
  }
}

TEST_F(CommandLineTest, TablesInEveryFormatNameTheCommandAndTheCommit) {
  Expect("run tiny.json --out out", 0, {"command: loopbench run", "commit: "});
  for (const std::string format : {"text", "csv", "markdown", "json", "latex"}) {
    const std::string call = "table out --group formulation --sort steps --format " + format;
    const Ending ending = Call(call);
    ExpectEnding(ending, 0, {"loopbench " + call, "commit", "machine", "compiler", "libraries"});
    EXPECT_EQ(ending.text.find("\033["), std::string::npos) << "colour in a pipe";
  }
  // JSON as a stranger's reader takes it: a list of rows
  Expect(
      "table out --format json | python3 -c \"import json, sys; "
      "print([type(row['steps']).__name__ for row in json.load(sys.stdin)])\"",
      0, {"['int', 'int']"});
  Expect("table out --columns formulation,stepz", 2,
         {"--columns: found \"stepz\"", "did you mean \"steps\"", "energy_error_max"});
  Expect("table out --descending", 2, {"--sort"});
  Expect("table --help", 0, {"Examples:", "loopbench table out"});
  // the same records and command give the same bytes: no date
  EXPECT_EQ(Call("table out --format csv").text, Call("table out --format csv").text);
  ExpectNone(ReadFile(folder_ / "out/drift.csv"), {"# date"});
}

TEST_F(CommandLineTest, WarningsAreSaidBelowTheTableAndFailTheGate) {
  Expect("run tiny.json --out out --fail-on warnings", 0, {"  ok  "});
  Expect("table out --fail-on warnings", 0, {"  ok  "});
  Write("parallelogram.json", ReadFile(kConfigs / "mechanisms/parallelogram.json"));
  const std::string flat =
      " --set /problems/0/mechanism=parallelogram.json --set /problems/0/horizon=2 --out out";
  Expect("run tiny.json --fail-on warnings" + flat, 1,
         {"  ok?  ", "singular-crossing: ", "2 have warnings"});
  Expect("table out --where mechanism=four-bar --fail-on warnings", 0, {"  ok  "});
  Expect("table out --columns mechanism,outcome --fail-on warnings", 1, {"finished?"});
  // a run that did not finish has not passed either
  Expect("run tiny.json --out failed --fail-on warnings --set /limits/steps=3", 1,
         {"2 did not finish and 0 have warnings"});
  Expect("table out --where mechanism=four-bar --kind timing --fail-on warnings", 2);
  Expect("run tiny.json --out out --fail-on warning", 2, {"warnings"});
}

TEST_F(CommandLineTest, FreeFiguresAreDrawnAndMistakesRefused) {
  Expect("run tiny.json --out out", 0);
  Expect("plot out --out w.svg --x formulation --y steps", 0, {"wrote w.svg"});
  ExpectWords(ReadFile(folder_ / "w.svg"), {"steps over formulation"});
  Expect("plot out --out figures --x steps --y energy_error_max --format pdf", 0,
         {"wrote figures/energy_error_max-over-steps.pdf"});
  Expect("plot out --out figures --format pdf", 0, {"figures to figures"});
  EXPECT_TRUE(fs::exists(folder_ / "figures/drift-four-bar-0.5s-rtol-1e-06.pdf"));
  Expect("plot out --out w.svg --x steps", 2, {"found --x KEY without --y KEY"});
  Expect("plot out --out w.svg --title t", 2, {"need --x KEY and --y KEY"});
  Expect("plot out --out w.svg --x step --y steps", 2,
         {"--x: found \"step\"", "did you mean \"steps\""});
  Expect("plot out --out w.svg --x steps --y steps --format pdf", 2,
         {"--out w.svg: found the ending \".svg\", expected \".pdf\""});
  Expect("plot out --out f --where kind=timing", 2, {"no records match kind=timing"});
  Write("bare.jsonl", "{\"kind\":\"timing\",\"bodies\":3}\n");
  Expect("plot bare.jsonl --out f", 2, {"no accuracy records", "--x KEY --y KEY"});
  Expect("plot --help", 0, {"Examples:", "--x rhs_evaluations"});
}

TEST_F(CommandLineTest, RepeatedRunGivesTheSameHashesWithAnyNumberOfJobs) {
  Expect("run tiny.json", 0, {"results in results/runs/tiny"});
  EXPECT_TRUE(fs::exists(folder_ / "results/runs/tiny/drift.csv"));
  Expect("run tiny.json --out two --jobs 2", 0);
  const auto hashes = [this](const char* store) {
    std::vector<std::string> found;
    for (const Record& record : ReadRecords(folder_ / store)) {
      found.push_back(record.Text("case_id") + record.Text("state_hash"));
    }
    std::ranges::sort(found);
    return found;
  };
  EXPECT_EQ(hashes("results/runs/tiny"), hashes("two"));
}

class OldResults : public CommandLineTest {
 protected:
  void SetUp() override {
    CommandLineTest::SetUp();
    Expect("run tiny.json --out out", 0);
    records_ = ReadFile(folder_ / "out/results.jsonl");
    table_ = ReadFile(folder_ / "out/drift.csv");
  }
  void ExpectKept() const {
    EXPECT_EQ(ReadFile(folder_ / "out/results.jsonl"), records_);
    EXPECT_EQ(ReadFile(folder_ / "out/drift.csv"), table_);
  }
  std::string records_, table_;
};

TEST_F(OldResults, StayWhenTheSecondExperimentIsBad) {
  Write("bad.json", "{\"name\": \"bad\"}");
  Expect("run tiny.json bad.json --out out", 2, {"bad.json"});
  ExpectKept();
}

TEST_F(OldResults, StayWhenARunIsKilled) {
  Write("long.json", Replaced(kTinyExperiment, "\"horizon\": 0.5", "\"horizon\": [0.5, 10000]"));
  // timeout reports a killed child as 137, or dies of the same signal itself
  const Ending ending = Call("run long.json --out out", "timeout -s KILL 0.5");
  EXPECT_NE(ending.code, 0) << ending.text;
  EXPECT_TRUE(ReadFile(folder_ / "out/results.jsonl").starts_with(records_));
  EXPECT_EQ(ReadFile(folder_ / "out/drift.csv"), table_);
}

TEST_F(OldResults, StayWhenARunHasPartOfTheirCases) {
  Expect("run tiny.json --out out --filter formulation=odca", 0, {"ran 0 cases, 1 reused"});
  EXPECT_EQ(ReadFile(folder_ / "out/results.jsonl"), records_);
  // a run's tables are of what it was asked for, those of table of all that there is
  ExpectNone(ReadFile(folder_ / "out/drift.csv"), {"lagrange"});
  Expect("table out --format csv", 0, {"lagrange", "odca"});
}

// `loopbench plot`: each standard figure that can be drawn, of the run that is trusted most.

class FiguresOfAStore : public CommandLineTest {};

TEST_F(FiguresOfAStore, OneThatCannotBeDrawnDoesNotStopTheOthers) {
  // the drift of a pendulum, which has no loops, is zero: nothing for a logarithmic axis
  Write("pendulum.json", ReadFile(kConfigs / "mechanisms/pendulum.json"));
  Write("tiny.json", Replaced(kTinyExperiment, "\"problems\": [",
                              R"("problems": [{"mechanism": "pendulum.json", "horizon": 0.5}, )"));
  Expect("run tiny.json --out out", 0);
  Expect("plot out --out figures", 2,
         {"drift-pendulum-0.5s-rtol-1e-06.svg: no curve has a point to draw",
          "wrote 3 of 4 figures to figures"});
  for (const char* name :
       {"motion-four-bar-0.5s", "motion-pendulum-0.5s", "drift-four-bar-0.5s-rtol-1e-06"}) {
    EXPECT_TRUE(fs::exists(folder_ / "figures" / (std::string(name) + ".svg"))) << name;
  }
}

TEST_F(FiguresOfAStore, MotionIsThatOfLevelPositionWhereItIsStored) {
  Write("tiny.json",
        Replaced(kTinyExperiment, "\"acceleration\"", R"(["acceleration", "projection"])"));
  Expect("run tiny.json --out out", 0);
  Expect("plot out --out figures", 0, {"wrote 2 figures"});
  Expect("plot out --out a.pdf", 2, {"found the ending \".pdf\"", "a file needs --x"});
  Expect("plot out --out a.png --x rtol --y steps", 2,
         {"found the ending \".png\"", "expected \".svg\", \".pdf\" or a folder"});
  const std::string svg = ReadFile(folder_ / "figures/motion-four-bar-0.5s.svg");
  ExpectWords(svg, {", projection, joint, rank-revealing, rtol 10⁻⁶"});
}

// `loopbench robustness`.

constexpr const char* kMap = R"({
  "title": "Tiny map",
  "methods": [{"label": "O-DCA", "select": {"formulation": "odca"}},
              {"label": "reduction", "select": {"formulation": "reduction"}}],
  "groups": [{"label": "regular", "rows": [
    {"label": "four-bar", "select": {"mechanism": "four-bar"}, "required": ["O-DCA"],
     "criteria": [{"measure": "drift_position_max", "limit": 1e-3, "unit": "m"}]}]}]
})";

class MapCommandTest : public CommandLineTest {
 protected:
  void SetUp() override {
    CommandLineTest::SetUp();
    Write("map.json", kMap);
    ASSERT_EQ(Call("run tiny.json --out out").code, 0);
  }
};

TEST_F(MapCommandTest, PrintsAndWritesTheMap) {
  Expect("robustness out --rules map.json", 0,
         {"ok ", "?", "2 cells", "command: loopbench robustness"});
  EXPECT_FALSE(fs::exists(folder_ / "out/robustness-map.csv"));
  Expect("robustness out --rules map.json --out report", 0, {"wrote report/robustness-map.csv"});
  const std::string csv = ReadFile(folder_ / "report/robustness-map.csv");
  ExpectWords(csv,
              {"regular,four-bar,O-DCA,holds,holds,finished,drift_position_max,", "# command: "});
  ExpectNone(csv, {"# date: "});
  ExpectWords(ReadFile(folder_ / "report/robustness-map.md"), {"# Tiny map"});
  ExpectWords(ReadFile(folder_ / "report/robustness-map.svg"), {"</svg>"});
  Expect("robustness out --rules map.json --out report --format pdf", 0, {"robustness-map.pdf"});
  EXPECT_EQ(ReadFile(folder_ / "report/robustness-map.pdf").substr(0, 5), "%PDF-");
}

TEST_F(MapCommandTest, GateFailsOnWhatMustHoldAndDoesNot) {
  Expect("robustness out --rules map.json --fail-on required", 0, {"ok "});
  Write("all.json", Replaced(kMap, "[\"O-DCA\"]", "\"all\""));
  Expect("robustness out --rules all.json", 0);
  Expect("robustness out --rules all.json --fail-on required", 1,
         {"must hold: reduction / four-bar: not measured (no record matches)"});
  Write("none.json", Replaced(kMap, "\"required\": [\"O-DCA\"],", ""));
  Expect("robustness out --rules none.json --fail-on required", 2,
         {"--fail-on required: no cell of none.json"});
}

TEST_F(MapCommandTest, RefusesBadInput) {
  Expect("check map.json", 0, {"robustness map of 1 row and 2 methods"});
  Expect("robustness nowhere --rules map.json", 2, {"nowhere"});
  Expect("robustness out --rules nowhere.json", 2, {"nowhere.json"});
  Expect(
      "robustness out --rules claims.json", 2,
      {"claims.json:1: (top level): found claims (it has \"claims\"), expected a robustness map"});
  Expect("robustness out", 2, {"--rules"});
  Expect("robustness out --rules map.json --format png", 2, {"png"});
  Expect("robustness --help", 0, {"required", "inaccurate", "\"relative_to\": \"rtol\""});
}

}  // namespace loopbench::harness::cli_test
