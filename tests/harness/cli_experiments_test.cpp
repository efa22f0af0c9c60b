// Sweeps, --set, plan and explain through the program.
#include "harness/config/experiment_reader.h"
#include "tests/harness/cli_fixture.h"

namespace loopbench::harness::cli_experiments_test {

/// tiny.json with a sweep of two masses, without the lagrange cases of the second.
std::string Swept() {
  return TinyWith(R"("sweep": [{"name": "mass", "values": [1, 2],
      "field": "/problems/0/mechanism/bodies/1/mass"}],
    "exclude": [{"mass": 2, "formulation": "lagrange"}])");
}

TEST_F(CommandLineTest, SweptValuesAreInRecordsAndFilters) {
  Write("sweep.json", Swept());
  Expect("list sweep.json", 0, {"mass", "3 cases and 0 timings in 2 combinations"});
  Expect("check sweep.json", 0, {"3 cases in 2 combinations"});
  Expect("run sweep.json --out out", 0, {"results in out"});
  const std::vector<Record> records = ReadRecords(folder_ / "out");
  ASSERT_EQ(records.size(), 3u);
  std::vector<double> masses;
  std::vector<std::string> hashes;
  for (const Record& record : records) {
    masses.push_back(record.Number("mass"));
    if (record.Text("formulation") == "odca") hashes.push_back(record.Text("state_hash"));
  }
  std::ranges::sort(masses);
  EXPECT_EQ(masses, (std::vector<double>{1.0, 1.0, 2.0}));
  ASSERT_EQ(hashes.size(), 2u);
  EXPECT_NE(hashes[0], hashes[1]);  // the mass did change the motion
  Expect("run sweep.json --out two --filter mass=2", 0, {"results in two"});
  EXPECT_EQ(ReadRecords(folder_ / "two").size(), 1u);
  Expect("list sweep.json --filter mass=7", 2, {"no case matches mass=7"});
  Expect("table out --where mass=2", 0, {"odca"});
}

TEST_F(CommandLineTest, SweptValuesAreInNamesOfTrajectories) {
  Write("sweep.json", Replaced(Swept(), "\"timing\"", R"("output": {"step": 0.25}, "timing")"));
  Expect("run sweep.json --out out", 0, {"results in out"});
  const std::string list = Call("trajectory out").text;
  ExpectWords(list.substr(0, list.find('\n')), {"  mass  "});
  Expect("trajectory out --out csv", 0, {"-mass-1-", "-mass-2-"});
  std::size_t heavy = 0;
  for (const auto& entry : fs::directory_iterator(folder_ / "csv")) {
    const std::string name = entry.path().filename().string();
    const std::string mass = name.find("-mass-2-") != std::string::npos ? "2" : "1";
    EXPECT_TRUE(ReadFile(entry.path()).starts_with("# mass: " + mass + "\n")) << name;
    heavy += mass == "2" ? 1 : 0;
  }
  EXPECT_EQ(heavy, 1u);
}

TEST_F(CommandLineTest, KeysOfStoredRecordsAreNoNamesForAxes) {
  Expect("run tiny.json --set /timing/repeats=1 --out out", 0);
  std::set<std::string> keys;
  for (const Record& record : ReadRecords(folder_ / "out")) {
    for (const auto& [key, value] : record.items()) keys.insert(key);
  }
  EXPECT_GE(keys.size(), 30u);
  for (const std::string& key : keys) {
    const std::string text =
        TinyWith(R"("sweep": [{"name": ")" + key + R"(", "field": "/comment", "values": ["x"]}])");
    EXPECT_THROW(ParseExperiments(text, folder_ / "e.json"), ConfigError) << key;
  }
}

TEST_F(CommandLineTest, SetChangesAFieldForEveryCommandThatReads) {
  const std::string set = " --set /problems/0/horizon=[0.1,0.2] --set /problems/0/name=mine";
  Expect("list tiny.json" + set, 0, {"mine", "4 cases"});
  Expect("check" + set + " tiny.json", 0, {"4 cases"});
  Expect("estimate tiny.json" + set, 0, {"4 cases, 4 runs"});
  Expect("explain tiny.json" + set, 0, {"mine", "planar"});
  Expect("run tiny.json --out out" + set, 0, {"results in out"});
  EXPECT_EQ(ReadRecords(folder_ / "out").size(), 4u);
  Expect("run tiny.json --set /tolerance=1e-3", 2, {"did you mean \"tolerances\""});
  Expect("run tiny.json --set tolerances=1e-3", 2, {"/json/pointer=value"});
  Expect("check four-bar.json --set /name=x", 2, {"--set is for experiments"});
}

TEST_F(CommandLineTest, PlanCountsCasesRunsAndTimings) {
  const std::string text = Replaced(
      Replaced(Swept(), "\"repeats\": 0", "\"repeats\": 1"), "\"timing\"",
      R"("ensembles": [{"size": 3, "seed": 1, "perturb": 0.1, "formulation": "odca"}], "timing")");
  Write("sweep.json", text);
  // 3 cases, two of them with 3 more runs; the excluded column of the second mass is not timed
  Expect("estimate sweep.json", 0,
         {"axis mass: 2 values", "2 combinations", "3 cases, 9 runs", "3 timings", "pilot",
          "Estimated from"});
  Expect("estimate sweep.json --filter formulation=lagrange", 0, {"1 case, 1 run", "1 timing"});
  const Ending untimed = Call("estimate sweep.json --no-timing");
  ExpectEnding(untimed, 0, {"3 cases, 9 runs", " 0 timings"});
  ExpectNone(untimed.text, {", timings"});
  Expect("list sweep.json --filter formulation=lagrange", 0, {"1 case and 1 timing"});
  Expect("run sweep.json --filter formulation=lagrange --out few", 0);
  EXPECT_EQ(ReadRecords(folder_ / "few").size(), 2u) << "a run and its timing";
  Expect("run sweep.json --no-timing --out out", 0);
  Expect("estimate sweep.json --set /timing/repeats=0 --timings-from out", 0,
         {"3 of 3 cases from out"});
  Expect("estimate sweep.json --timings-from nowhere", 2, {"nowhere"});
}

TEST_F(CommandLineTest, ExplainSaysWhatRunsAndWhatWordsMean) {
  Write("sweep.json", Swept());
  const Ending ending = Call("explain sweep.json");
  ExpectEnding(ending, 0,
               {"3 cases", "mass: 1, 2", "formulation=lagrange", "odca: orthogonal-complement",
                "lagrange: Lagrange multipliers", "rank-revealing:", "2048 MiB", "no timings"});
  // words that the experiment does not use stay out
  ExpectNone(ending.text, {"absolute:", "  reduction: "});
}

// Runs in several scalars.

/// tiny.json with a section "precision".
std::string WithPrecision(const std::string& section) {
  return TinyWith("\"precision\": " + section);
}

constexpr const char* kLadder =
    R"({"scalars": ["float", "double"], "tolerances": [1e-4, 1e-15], "reference": 1e-20})";

#ifdef LOOPBENCH_PRECISIONS

TEST_F(CommandLineTest, LaddersAreInRecordsTablesAndFigures) {
  Write("tiny.json", WithPrecision(kLadder));
  Expect("list tiny.json", 0, {"2 cases and 0 timings, 10 runs in several scalars"});
  Expect("explain tiny.json", 0, {"10 runs in several floating-point types"});
  Expect("run tiny.json --precision-only --out out", 0,
         {"ran 10 cases (2 not finished), 0 reused", "Precision", "small step"});
  Expect("run tiny.json --precision-only --out out", 0, {"ran 0 cases, 10 reused"});
  std::size_t references = 0, ruled = 0;
  for (const Record& record : ReadRecords(folder_ / "out")) {
    EXPECT_EQ(record.Text("kind"), "precision");
    if (record.Text("integrator") == "gragg") {
      ++references;
      EXPECT_EQ(record.Text("scalar"), "float128");
      EXPECT_EQ(record.Number("rtol"), 1e-20);
      EXPECT_LE(record.Number("error_final"), 1e-14);
    } else if (record.Text("scalar") == "float" && record.Number("rtol") == 1e-15) {
      EXPECT_EQ(record.Text("outcome"), "step-too-small");
      EXPECT_EQ(record.Find("error_final"), nullptr);
    } else {
      EXPECT_EQ(record.Text("outcome"), "finished");
      EXPECT_LE(record.Number("error_final"), 1e-2);
      ruled += record.Text("error_dominated_by").empty() ? 0 : 1;
    }
  }
  EXPECT_EQ(references, 2u);
  EXPECT_EQ(ruled, 4u);  // at 1e-15 double has none beside it that finished
  const std::string csv = ReadFile(folder_ / "out/precision.csv");
  ExpectWords(csv, {"scalar,rtol", "# dominated by: ", "# command: "});
  EXPECT_FALSE(fs::exists(folder_ / "out/drift.csv"));
  Expect("table out --kind precision --where scalar=float", 0, {"float"});
  Expect("plot out --out figures", 0, {"wrote 2 figures"});
  EXPECT_TRUE(fs::exists(folder_ /
                         "figures/precision-four-bar-odca-acceleration-joint-rank-revealing.svg"));
}

TEST_F(CommandLineTest, FiltersAndSwitchesChooseLadders) {
  Write("tiny.json", WithPrecision(kLadder));
  Expect("run tiny.json --filter formulation=odca --out odca", 0, {"ran 6 cases (1 not finished)"});
  EXPECT_EQ(ReadRecords(folder_ / "odca").size(), 6u);  // one case, one ladder of five
  Expect("run tiny.json --timing-only --precision-only", 2, {"excludes"});
}

TEST_F(CommandLineTest, LaddersRefuseWhatTheyCannotRun) {
  Write("tiny.json", Replaced(WithPrecision(kLadder), "four-bar.json",
                              (kConfigs / "mechanisms/spatial-four-bar.json").string()));
  for (const char* command : {"check", "list", "run"}) {
    Expect(std::string(command) + " tiny.json", 2,
           {"tiny.json: /precision: problem \"spatial-four-bar\": found a spatial mechanism, "
            "expected planar ones"});
  }
  EXPECT_FALSE(fs::exists(folder_ / "results"));
  Write("tiny.json", WithPrecision(R"({"scalars": ["quad"]})"));
  Expect("check tiny.json", 2,
         {"/precision/scalars/0", "found \"quad\"",
          R"("float", "double", "long-double", "float128")"});
}

#else

TEST_F(CommandLineTest, LaddersNeedABuildWithTheirScalars) {
  Write("tiny.json", WithPrecision(kLadder));
  Expect("check tiny.json", 0);
  Expect("run tiny.json --out out", 2, {"/precision", "-DLOOPBENCH_PRECISIONS=ON"});
}

#endif

}  // namespace loopbench::harness::cli_experiments_test
