// The program as its users call it: exit codes, messages, and the files it leaves.
#include <algorithm>

#include "tests/harness/cli_fixture.h"

namespace loopbench::harness {
namespace cli_test {

class BadInput : public CommandLineTest {
 protected:
  /// Run and check refuse the folder's files with the same words, and nothing is written.
  void ExpectRefused(const std::vector<std::string>& words) const {
    ExpectEnding(Call("run tiny.json --out out"), 2, words);
    ExpectEnding(Call("check tiny.json"), 2, words);
    EXPECT_FALSE(fs::exists(folder_ / "out"));
  }
};

TEST_F(BadInput, UnknownKeyOfAMechanismNamesFilePointerAndSpelling) {
  EditMechanism("\"inertia\"", "\"inertai\"");
  ExpectRefused({"/bodies/0/inertai: found unknown key", "did you mean \"inertia\""});
}

TEST_F(BadInput, UnknownKeyOfAnExperimentNamesFilePointerAndSpelling) {
  Write("tiny.json", std::string(R"({"tolerance": 1e-6,)") + (kTinyExperiment + 1));
  ExpectRefused({"/tolerance: found unknown key", "did you mean \"tolerances\""});
}

TEST_F(BadInput, WrongTypeNamesValueAndExpectation) {
  EditMechanism("\"mass\": 1.0", "\"mass\": \"heavy\"");
  ExpectRefused({"/bodies/0/mass: found \"heavy\"", "expected a number > 0"});
}

TEST_F(BadInput, MissingBodyNamesTheNearestOne) {
  EditMechanism("\"to\": {\"body\": \"bar1\"", "\"to\": {\"body\": \"bra1\"");
  ExpectRefused({"/joints/0/to/body: found \"bra1\"", "did you mean \"bar1\""});
}

TEST_F(BadInput, NegativeMassNamesValueAndRange) {
  EditMechanism("\"mass\": 1.0", "\"mass\": -1.0");
  ExpectRefused({"/bodies/0/mass: found -1", "expected a number > 0"});
}

TEST_F(BadInput, MissingMechanismFileNamesThePointerThatAsksForIt) {
  fs::rename(folder_ / "four-bar.json", folder_ / "four-bars.json");
  ExpectRefused(
      {"/problems/0/mechanism", "four-bar.json does not exist", "did you mean \"four-bars.json\""});
}

TEST_F(BadInput, AllMistakesAreReportedAtOnce) {
  EditMechanism("\"mass\": 1.0, \"inertia\": 1.0", "\"mass\": -1.0, \"inertia\": -2.0");
  ExpectRefused({"/bodies/0/mass: found -1", "/bodies/0/inertia: found -2"});
}

TEST_F(BadInput, MissingExperimentFileIsNamed) {
  for (const char* command : {"run", "list", "check"}) {
    ExpectEnding(Call(std::string(command) + " absent.json"), 2, {"absent.json"});
  }
}

TEST_F(BadInput, UnknownSubcommandsAndOptionsAreRefused) {
  ExpectEnding(Call("rum tiny.json"), 2, {"rum"});
  ExpectEnding(Call(""), 2, {"expected a command"});
  ExpectEnding(Call("run tiny.json --fliter a=b"), 2, {"--fliter"});
  ExpectEnding(Call("run tiny.json --jobs 0"), 2, {"--jobs"});
  ExpectEnding(Call("run"), 2, {"experiment"});
}

TEST_F(BadInput, BadFilterIsRefusedWithItsTextAndForm) {
  for (const char* filter : {"mechanism", "=four-bar", "mechanism="}) {
    ExpectEnding(Call(std::string("run tiny.json --filter ") + filter), 2,
                 {std::string("filter '") + filter + "'", "key=value"});
  }
}

TEST_F(BadInput, FilterThatLeavesNoCaseIsRefused) {
  // a run of nothing would replace old results with an empty file
  ExpectEnding(Call("run tiny.json --out out --filter mechanism=five-bar"), 2,
               {"mechanism=five-bar"});
  EXPECT_FALSE(fs::exists(folder_ / "out/results.jsonl"));
}

TEST_F(BadInput, FilterOnAnUnknownKeyIsRefused) {
  ExpectEnding(Call("list tiny.json --filter mechanisms=four-bar"), 2, {"mechanisms"});
}

TEST_F(BadInput, EmptyStoreIsNamed) {
  ExpectEnding(Call("table nowhere"), 2, {"nowhere"});
  ExpectEnding(Call("plot nowhere --out figures"), 2, {"nowhere"});
  ExpectEnding(Call("check-claims nowhere --claims claims.json"), 2, {"nowhere"});
}

TEST_F(CommandLineTest, HelpEndsWithZeroAndShowsExamples) {
  ExpectEnding(Call("--help"), 0, {"Examples (from", "Exit status: 0 success"});
  ExpectEnding(Call("run --help"), 0, {"--filter"});
  ExpectEnding(Call("--version"), 0, {"loopbench 1.", "commit: ", "compiler: ", "SUNDIALS "});
}

TEST_F(CommandLineTest, UnreachableAssemblyIsARowAndNoError) {
  EditMechanism("\"C\": [1.5, 0.0]", "\"C\": [5.0, 0.0]");
  ExpectEnding(Call("run tiny.json --out out"), 0, {"bad start"});
  const std::vector<Record> records = ReadRecords(folder_ / "out");
  ASSERT_EQ(records.size(), 2u);
  EXPECT_EQ(records[0].Text("outcome"), "inconsistent-start");
  EXPECT_NE(records[0].Text("message").find("\"OC\""), std::string::npos);
}

TEST_F(CommandLineTest, ListShowsEveryCase) {
  ExpectEnding(Call("list tiny.json"), 0,
               {"tiny: two cases", "four-bar", "odca", "lagrange", "2 cases and 0 timings"});
  ExpectEnding(Call("list tiny.json --filter formulation=odca"), 0, {"1 case and 0 timings"});
}

TEST_F(CommandLineTest, CheckCountsWhatSoundFilesHold) {
  ExpectEnding(Call("check tiny.json four-bar.json"), 0, {"2 cases", "3 bodies, 4 joints"});
  ExpectEnding(Call("check claims.json"), 0, {"claims.json: 1 claim"});
}

TEST_F(CommandLineTest, ResultsOfARunServeTablePlotAndVerdict) {
  ExpectEnding(Call("run tiny.json --out out"), 0, {"results in out"});
  const std::string csv = ReadFile(folder_ / "out/drift.csv");
  EXPECT_NE(csv.find("drift_position_max"), std::string::npos);
  const std::string table = ReadFile(folder_ / "out/drift.md");
  EXPECT_NE(table.find("command: loopbench run tiny.json --out out"), std::string::npos);
  EXPECT_EQ(ReadRecords(folder_ / "out").size(), 2u);

  ExpectEnding(Call("table out"), 0, {"four-bar", "odca", "lagrange"});
  ExpectEnding(Call("table out --format csv --where formulation=odca"), 0, {"mechanism", "odca"});
  ExpectEnding(Call("table out --where formulation=reduction"), 2, {"no drift records match"});
  ExpectEnding(Call("table out --where kind=timing"), 2, {"--kind timing"});
  ExpectEnding(Call("table --help"), 0, {"--group KEY "});
  ExpectEnding(Call("check-claims out --claims claims.json --out verdicts.md"), 0, {"reproduced"});
  EXPECT_NE(ReadFile(folder_ / "verdicts.md").find("It is."), std::string::npos);
  ExpectEnding(Call("plot out --out figures"), 0, {"figures to figures"});
  for (const auto& entry : fs::directory_iterator(folder_ / "figures")) {
    EXPECT_NE(ReadFile(entry.path()).find("<svg"), std::string::npos) << entry.path();
  }
}

TEST_F(CommandLineTest, TablesInEveryFormatNameTheCommandAndTheCommit) {
  ExpectEnding(Call("run tiny.json --out out"), 0, {"command: loopbench run", "commit: "});
  for (const std::string format : {"text", "csv", "markdown", "json", "latex"}) {
    const std::string call = "table out --group formulation --sort steps --format " + format;
    const Ending ending = Call(call);
    ExpectEnding(ending, 0, {"loopbench " + call, "commit", "machine", "compiler", "libraries"});
    EXPECT_EQ(ending.text.find("\033["), std::string::npos) << "colour in a pipe";
  }
  // JSON as a stranger's reader takes it: a list of rows
  ExpectEnding(Call("table out --format json | python3 -c \"import json, sys; "
                    "print([type(row['steps']).__name__ for row in json.load(sys.stdin)])\""),
               0, {"['int', 'int']"});
  ExpectEnding(Call("table out --columns formulation,stepz"), 2,
               {"--columns: found \"stepz\"", "did you mean \"steps\"", "energy_error_max"});
  ExpectEnding(Call("table out --descending"), 2, {"--sort"});
  ExpectEnding(Call("table --help"), 0, {"Examples:", "loopbench table out"});
  // the same records and command give the same bytes: no date
  EXPECT_EQ(Call("table out --format csv").text, Call("table out --format csv").text);
  EXPECT_EQ(ReadFile(folder_ / "out/drift.csv").find("# date"), std::string::npos);
}

TEST_F(CommandLineTest, WarningsAreSaidBelowTheTableAndFailTheGate) {
  ExpectEnding(Call("run tiny.json --out out --fail-on warnings"), 0, {"  ok  "});
  ExpectEnding(Call("table out --fail-on warnings"), 0, {"  ok  "});
  Write("parallelogram.json", ReadFile(kConfigs / "mechanisms/parallelogram.json"));
  const std::string flat =
      " --set /problems/0/mechanism=parallelogram.json --set /problems/0/horizon=2 --out out";
  ExpectEnding(Call("run tiny.json --fail-on warnings" + flat), 1,
               {"  ok?  ", "singular-crossing: ", "2 have warnings"});
  ExpectEnding(Call("table out --where mechanism=four-bar --fail-on warnings"), 0, {"  ok  "});
  ExpectEnding(Call("table out --columns mechanism,outcome --fail-on warnings"), 1, {"finished?"});
  // a run that did not finish has not passed either
  ExpectEnding(Call("run tiny.json --out failed --fail-on warnings --set /limits/steps=3"), 1,
               {"2 did not finish and 0 have warnings"});
  ExpectEnding(Call("table out --where mechanism=four-bar --kind timing --fail-on warnings"), 2,
               {});
  ExpectEnding(Call("run tiny.json --out out --fail-on warning"), 2, {"warnings"});
}

TEST_F(CommandLineTest, FreeFiguresAreDrawnAndMistakesRefused) {
  ExpectEnding(Call("run tiny.json --out out"), 0, {});
  ExpectEnding(Call("plot out --out w.svg --x formulation --y steps"), 0, {"wrote w.svg"});
  EXPECT_NE(ReadFile(folder_ / "w.svg").find("steps over formulation"), std::string::npos);
  ExpectEnding(Call("plot out --out figures --x steps --y energy_error_max --format pdf"), 0,
               {"wrote figures/energy_error_max-over-steps.pdf"});
  ExpectEnding(Call("plot out --out figures --format pdf"), 0, {"figures to figures"});
  EXPECT_TRUE(fs::exists(folder_ / "figures/drift-four-bar-0.5s-rtol-1e-06.pdf"));
  ExpectEnding(Call("plot out --out w.svg --x steps"), 2, {"found --x KEY without --y KEY"});
  ExpectEnding(Call("plot out --out w.svg --title t"), 2, {"need --x KEY and --y KEY"});
  ExpectEnding(Call("plot out --out w.svg --x step --y steps"), 2,
               {"--x: found \"step\"", "did you mean \"steps\""});
  ExpectEnding(Call("plot out --out w.svg --x steps --y steps --format pdf"), 2,
               {"--out w.svg: found the ending \".svg\", expected \".pdf\""});
  ExpectEnding(Call("plot out --out f --where kind=timing"), 2, {"no records match kind=timing"});
  Write("bare.jsonl", "{\"kind\":\"timing\",\"bodies\":3}\n");
  ExpectEnding(Call("plot bare.jsonl --out f"), 2, {"no accuracy records", "--x KEY --y KEY"});
  ExpectEnding(Call("plot --help"), 0, {"Examples:", "--x rhs_evaluations"});
}

TEST_F(CommandLineTest, DefaultFolderIsNamedAfterTheExperiment) {
  ExpectEnding(Call("run tiny.json"), 0, {"results in results/runs/tiny"});
  EXPECT_TRUE(fs::exists(folder_ / "results/runs/tiny/drift.csv"));
}

TEST_F(CommandLineTest, RepeatedRunGivesTheSameHashesWithAnyNumberOfJobs) {
  std::vector<std::vector<std::string>> hashes;
  for (const std::string jobs : {"1", "2"}) {
    ExpectEnding(Call("run tiny.json --out out" + jobs + " --jobs " + jobs), 0, {});
    std::vector<std::string> found;
    for (const Record& record : ReadRecords(folder_ / ("out" + jobs))) {
      found.push_back(record.Text("case_id") + record.Text("state_hash"));
    }
    std::ranges::sort(found);
    hashes.push_back(found);
  }
  EXPECT_EQ(hashes[0], hashes[1]);
}

class OldResults : public CommandLineTest {
 protected:
  void SetUp() override {
    CommandLineTest::SetUp();
    ExpectEnding(Call("run tiny.json --out out"), 0, {});
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
  ExpectEnding(Call("run tiny.json bad.json --out out"), 2, {"bad.json"});
  ExpectKept();
}

TEST_F(OldResults, StayWhenARunIsKilled) {
  std::string text = kTinyExperiment;
  const std::string horizon = "\"horizon\": 0.5";
  text.replace(text.find(horizon), horizon.size(), "\"horizon\": [0.5, 10000]");
  Write("long.json", text);
  // timeout reports a killed child as 137, or dies of the same signal itself
  const Ending ending = Call("run long.json --out out", "timeout -s KILL 0.5");
  EXPECT_NE(ending.code, 0) << ending.text;
  EXPECT_TRUE(ReadFile(folder_ / "out/results.jsonl").starts_with(records_));
  EXPECT_EQ(ReadFile(folder_ / "out/drift.csv"), table_);
}

TEST_F(OldResults, StayWhenARunHasPartOfTheirCases) {
  ExpectEnding(Call("run tiny.json --out out --filter formulation=odca"), 0,
               {"ran 0 cases, 1 reused"});
  EXPECT_EQ(ReadFile(folder_ / "out/results.jsonl"), records_);
  // a run's tables are of what it was asked for, those of table of all that there is
  EXPECT_EQ(ReadFile(folder_ / "out/drift.csv").find("lagrange"), std::string::npos);
  ExpectEnding(Call("table out --format csv"), 0, {"lagrange", "odca"});
}

}  // namespace cli_test
}  // namespace loopbench::harness
