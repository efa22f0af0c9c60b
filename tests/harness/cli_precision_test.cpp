// Runs in several scalars through the program: records, tables, figures and what is refused.
#include <gtest/gtest.h>

#include <string>

#include "tests/harness/cli_fixture.h"

namespace loopbench::harness {
namespace cli_precision_test {

/// tiny.json with a section "precision".
std::string WithPrecision(const std::string& section) {
  std::string text = kTinyExperiment;
  return text.insert(text.find("\"timing\""), "\"precision\": " + section + ", ");
}

constexpr const char* kLadder =
    R"({"scalars": ["float", "double"], "tolerances": [1e-4, 1e-15], "reference": 1e-20})";

#ifdef LOOPBENCH_PRECISIONS

TEST_F(CommandLineTest, LaddersAreInRecordsTablesAndFigures) {
  Write("tiny.json", WithPrecision(kLadder));
  ExpectEnding(Call("list tiny.json"), 0, {"2 cases and 0 timings, 10 runs in several scalars"});
  ExpectEnding(Call("explain tiny.json"), 0, {"10 runs in several floating-point types"});
  ExpectEnding(Call("run tiny.json --precision-only --out out"), 0,
               {"ran 10 cases (2 not finished), 0 reused", "Precision", "small step"});
  ExpectEnding(Call("run tiny.json --precision-only --out out"), 0, {"ran 0 cases, 10 reused"});
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
  EXPECT_NE(csv.find("scalar,rtol"), std::string::npos) << csv;
  EXPECT_NE(csv.find("# dominated by: "), std::string::npos) << csv;
  EXPECT_NE(csv.find("# command: "), std::string::npos) << csv;
  EXPECT_FALSE(fs::exists(folder_ / "out/drift.csv"));
  ExpectEnding(Call("table out --kind precision --where scalar=float"), 0, {"float"});
  ExpectEnding(Call("plot out --out figures"), 0, {"wrote 2 figures"});
  EXPECT_TRUE(fs::exists(folder_ /
                         "figures/precision-four-bar-odca-acceleration-joint-rank-revealing.svg"));
}

TEST_F(CommandLineTest, FiltersAndSwitchesChooseLadders) {
  Write("tiny.json", WithPrecision(kLadder));
  ExpectEnding(Call("run tiny.json --filter formulation=odca --out odca"), 0,
               {"ran 6 cases (1 not finished)"});
  EXPECT_EQ(ReadRecords(folder_ / "odca").size(), 6u);  // one case, one ladder of five
  ExpectEnding(Call("run tiny.json --timing-only --precision-only"), 2, {"excludes"});
}

TEST_F(CommandLineTest, LaddersRefuseWhatTheyCannotRun) {
  std::string text = WithPrecision(kLadder);
  const std::string plane = "four-bar.json";
  text.replace(text.find(plane), plane.size(),
               (kConfigs / "mechanisms/spatial-four-bar.json").string());
  Write("tiny.json", text);
  for (const char* command : {"check", "list", "run"}) {
    ExpectEnding(Call(std::string(command) + " tiny.json"), 2,
                 {"tiny.json: /precision: problem \"spatial-four-bar\": found a spatial mechanism, "
                  "expected planar ones"});
  }
  EXPECT_FALSE(fs::exists(folder_ / "results"));
  Write("tiny.json", WithPrecision(R"({"scalars": ["quad"]})"));
  ExpectEnding(Call("check tiny.json"), 2,
               {"/precision/scalars/0", "found \"quad\"",
                R"("float", "double", "long-double", "float128")"});
}

#else

TEST_F(CommandLineTest, LaddersNeedABuildWithTheirScalars) {
  Write("tiny.json", WithPrecision(kLadder));
  ExpectEnding(Call("check tiny.json"), 0, {});
  ExpectEnding(Call("run tiny.json --out out"), 2, {"/precision", "-DLOOPBENCH_PRECISIONS=ON"});
}

#endif

}  // namespace cli_precision_test
}  // namespace loopbench::harness
