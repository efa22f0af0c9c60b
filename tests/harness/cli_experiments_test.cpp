// Sweeps, --set, plan and explain through the program.
#include <gtest/gtest.h>

#include <algorithm>
#include <set>
#include <string>
#include <vector>

#include "harness/base/text.h"
#include "harness/config/experiment_reader.h"
#include "tests/harness/cli_fixture.h"

namespace loopbench::harness {
namespace cli_experiments_test {

/// tiny.json with a sweep of two masses, without the lagrange cases of the second.
std::string Swept() {
  std::string text = kTinyExperiment;
  const std::string end = "\"timing\": {\"repeats\": 0}";
  text.insert(text.find(end), R"("sweep": [{"name": "mass", "values": [1, 2],
      "field": "/problems/0/mechanism/bodies/1/mass"}],
    "exclude": [{"mass": 2, "formulation": "lagrange"}], )");
  return text;
}

TEST_F(CommandLineTest, SweptValuesAreInRecordsAndFilters) {
  Write("sweep.json", Swept());
  ExpectEnding(Call("list sweep.json"), 0, {"mass", "3 cases and 0 timings in 2 combinations"});
  ExpectEnding(Call("check sweep.json"), 0, {"3 cases in 2 combinations"});
  ExpectEnding(Call("run sweep.json --out out"), 0, {"results in out"});
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
  ExpectEnding(Call("run sweep.json --out two --filter mass=2"), 0, {"results in two"});
  EXPECT_EQ(ReadRecords(folder_ / "two").size(), 1u);
  ExpectEnding(Call("list sweep.json --filter mass=7"), 2, {"no case matches mass=7"});
  ExpectEnding(Call("table out --where mass=2"), 0, {"odca"});
}

TEST_F(CommandLineTest, SweptValuesAreInNamesOfTrajectories) {
  std::string text = Swept();
  text.insert(text.find("\"timing\""), R"("output": {"step": 0.25}, )");
  Write("sweep.json", text);
  ExpectEnding(Call("run sweep.json --out out"), 0, {"results in out"});
  const std::string list = Call("trajectory out").text;
  EXPECT_NE(list.substr(0, list.find('\n')).find("  mass  "), std::string::npos) << list;
  ExpectEnding(Call("trajectory out --out csv"), 0, {"-mass-1-", "-mass-2-"});
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
  ExpectEnding(Call("run tiny.json --set /timing/repeats=1 --out out"), 0, {});
  std::set<std::string> keys;
  for (const Record& record : ReadRecords(folder_ / "out")) {
    for (const auto& [key, value] : record.items()) keys.insert(key);
  }
  EXPECT_GE(keys.size(), 30u);
  for (const std::string& key : keys) {
    std::string text = kTinyExperiment;
    text.insert(text.find("\"timing\""),
                R"("sweep": [{"name": ")" + key + R"(", "field": "/comment", "values": ["x"]}], )");
    EXPECT_THROW(ParseExperiments(text, folder_ / "e.json"), ConfigError) << key;
  }
}

TEST_F(CommandLineTest, SetChangesAFieldForEveryCommandThatReads) {
  const std::string set = " --set /problems/0/horizon=[0.1,0.2] --set /problems/0/name=mine";
  ExpectEnding(Call("list tiny.json" + set), 0, {"mine", "4 cases"});
  ExpectEnding(Call("check" + set + " tiny.json"), 0, {"4 cases"});
  ExpectEnding(Call("estimate tiny.json" + set), 0, {"4 cases, 4 runs"});
  ExpectEnding(Call("explain tiny.json" + set), 0, {"mine", "planar"});
  ExpectEnding(Call("run tiny.json --out out" + set), 0, {"results in out"});
  EXPECT_EQ(ReadRecords(folder_ / "out").size(), 4u);
  ExpectEnding(Call("run tiny.json --set /tolerance=1e-3"), 2, {"did you mean \"tolerances\""});
  ExpectEnding(Call("run tiny.json --set tolerances=1e-3"), 2, {"/json/pointer=value"});
  ExpectEnding(Call("check four-bar.json --set /name=x"), 2, {"--set is for experiments"});
}

TEST_F(CommandLineTest, PlanCountsCasesRunsAndTimings) {
  std::string text = Swept();
  text.replace(text.find("\"repeats\": 0"), 12, "\"repeats\": 1");
  text.insert(text.find("\"timing\""), R"("ensembles": [{"size": 3, "seed": 1, "perturb": 0.1,
      "formulation": "odca"}], )");
  Write("sweep.json", text);
  // 3 cases, two of them with 3 more runs; the excluded column of the second mass is not timed
  ExpectEnding(Call("estimate sweep.json"), 0,
               {"axis mass: 2 values", "2 combinations", "3 cases, 9 runs", "3 timings", "pilot",
                "Estimated from"});
  ExpectEnding(Call("estimate sweep.json --filter formulation=lagrange"), 0,
               {"1 case, 1 run", "1 timing"});
  const Ending untimed = Call("estimate sweep.json --no-timing");
  ExpectEnding(untimed, 0, {"3 cases, 9 runs", " 0 timings"});
  EXPECT_EQ(untimed.text.find(", timings"), std::string::npos) << untimed.text;
  ExpectEnding(Call("list sweep.json --filter formulation=lagrange"), 0, {"1 case and 1 timing"});
  ExpectEnding(Call("run sweep.json --filter formulation=lagrange --out few"), 0, {});
  EXPECT_EQ(ReadRecords(folder_ / "few").size(), 2u) << "a run and its timing";
  ExpectEnding(Call("run sweep.json --no-timing --out out"), 0, {});
  ExpectEnding(Call("estimate sweep.json --set /timing/repeats=0 --timings-from out"), 0,
               {"3 of 3 cases from out"});
  ExpectEnding(Call("estimate sweep.json --timings-from nowhere"), 2, {"nowhere"});
}

TEST_F(CommandLineTest, ExplainSaysWhatRunsAndWhatWordsMean) {
  Write("sweep.json", Swept());
  const Ending ending = Call("explain sweep.json");
  ExpectEnding(ending, 0,
               {"3 cases", "mass: 1, 2", "formulation=lagrange", "odca: orthogonal-complement",
                "lagrange: Lagrange multipliers", "rank-revealing:", "2048 MiB", "no timings"});
  // words that the experiment does not use stay out
  EXPECT_EQ(ending.text.find("absolute:"), std::string::npos) << ending.text;
  EXPECT_EQ(ending.text.find("  reduction: "), std::string::npos) << ending.text;
}

}  // namespace cli_experiments_test
}  // namespace loopbench::harness
